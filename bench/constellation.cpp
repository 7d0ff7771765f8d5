// One-shot localisation among identical landmarks, and changing their map.
//   bench_constellation --benchmark_min_time=1
#include <benchmark/benchmark.h>

#include <random>

#include "common/constellation/map.hpp"
#include "sim/forest.hpp"

using namespace understory;

namespace {

struct Scene {
  sim::Forest forest;
  constellation::ConstellationMap map;
};

/// One square kilometre.
const Scene& scene(sim::ForestKind kind) {
  static std::array<Scene, 3> scenes = [] {
    std::array<Scene, 3> made;
    for (const auto each :
         {sim::ForestKind::kDense, sim::ForestKind::kIntermediate, sim::ForestKind::kSparse}) {
      Scene& scene = made[static_cast<std::size_t>(each)];
      std::mt19937_64 random(1);
      scene.forest = sim::make_forest(sim::forest_parameters(each), random);
      for (std::size_t i = 0; i < scene.forest.trunks_m.size(); ++i) {
        scene.map.insert(i + 1, scene.forest.trunks_m[i]);
      }
    }
    return made;
  }();

  return scenes[static_cast<std::size_t>(kind)];
}

std::vector<constellation::ObservedPoint> observe(const sim::Forest& forest, double detection,
                                                  double sigma_m, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, sigma_m);
  const double x = 100.0 + 800.0 * unit(random);
  const double y = 100.0 + 800.0 * unit(random);
  const geometry::SE2 sensor_T_map = geometry::SE2(x, y, 6.0 * unit(random)).inverse();
  std::vector<constellation::ObservedPoint> points;
  for (const Eigen::Vector2d& trunk : forest.trunks_m) {
    const Eigen::Vector2d point = sensor_T_map * trunk;
    if (point.norm() > 40.0 || unit(random) > detection) continue;
    points.push_back({point + Eigen::Vector2d(noise(random), noise(random)), sigma_m});
  }
  return points;
}

/// Arguments: forest, detection [%], sigma [mm].
void BM_Localise(benchmark::State& state) {
  const Scene& in = scene(static_cast<sim::ForestKind>(state.range(0)));
  std::mt19937_64 random(2);
  std::vector<std::vector<constellation::ObservedPoint>> observations(200);

  for (auto& points : observations) {
    points = observe(in.forest, 0.01 * static_cast<double>(state.range(1)),
                     0.001 * static_cast<double>(state.range(2)), random);
  }

  std::size_t i = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    found += in.map.localise(observations[i++ % observations.size()]).found() ? 1 : 0;
  }

  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}
BENCHMARK(BM_Localise)
    ->Args({static_cast<int>(sim::ForestKind::kIntermediate), 90, 80})
    ->Args({static_cast<int>(sim::ForestKind::kIntermediate), 80, 200})
    ->Args({static_cast<int>(sim::ForestKind::kSparse), 90, 80})
    ->Args({static_cast<int>(sim::ForestKind::kDense), 90, 80})
    ->Unit(benchmark::kMicrosecond);

/// An observation of another forest: what "not sure" costs.
void BM_NotSure(benchmark::State& state) {
  const Scene& in = scene(sim::ForestKind::kIntermediate);
  std::mt19937_64 random(3);
  const sim::Forest other =
      sim::make_forest(sim::forest_parameters(sim::ForestKind::kIntermediate), random);
  std::vector<std::vector<constellation::ObservedPoint>> observations(50);
  for (auto& points : observations) {
    points = observe(other, 0.9, 0.001 * static_cast<double>(state.range(0)), random);
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(in.map.localise(observations[i++ % observations.size()]));
  }
}
BENCHMARK(BM_NotSure)->Arg(80)->Arg(200)->Unit(benchmark::kMicrosecond);

/// A landmark less and one more.
void BM_RemoveInsert(benchmark::State& state) {
  constellation::ConstellationMap map = scene(sim::ForestKind::kIntermediate).map;
  std::mt19937_64 random(4);
  for (auto _ : state) {
    const constellation::LandmarkId id = 1 + random() % map.size();
    const Eigen::Vector2d position = *map.position(id);
    map.remove(id);
    map.insert(id, position);
  }
  state.SetItemsProcessed(2 * state.iterations());
}
BENCHMARK(BM_RemoveInsert)->Unit(benchmark::kMicrosecond);

/// A landmark moved by centimetres, as by the graph.
void BM_Move(benchmark::State& state) {
  constellation::ConstellationMap map = scene(sim::ForestKind::kIntermediate).map;
  std::mt19937_64 random(5);
  std::normal_distribution<double> step(0.0, 0.02);
  for (auto _ : state) {
    const constellation::LandmarkId id = 1 + random() % map.size();
    map.move(id, *map.position(id) + Eigen::Vector2d(step(random), step(random)));
  }
}
BENCHMARK(BM_Move)->Unit(benchmark::kMicrosecond);

void BM_Nearest(benchmark::State& state) {
  const constellation::ConstellationMap& map = scene(sim::ForestKind::kIntermediate).map;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> place(0.0, 1000.0);
  for (auto _ : state) {
    const double x = place(random);
    benchmark::DoNotOptimize(map.nearest({x, place(random)}, 1.0));
  }
}
BENCHMARK(BM_Nearest)->Unit(benchmark::kNanosecond);

}  // namespace
