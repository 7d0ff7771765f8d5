// Existence of map points: ns per point and look, up to a million points in view.
//   bench_existence --benchmark_min_time=1
#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"
#include "common/existence/von_mises_fisher_shell.hpp"

using namespace understory::existence;

namespace {

/// Points around the sensor, which moves on with every frame.
template <typename S>
struct ExistenceScene {
  explicit ExistenceScene(std::size_t count) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<float> side(-30.0F, 30.0F);
    points.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const float x = side(random), y = side(random);
      positions.emplace_back(x, y, 0.1F * side(random));
      points.push_back(PointExistence<S>::known(model));
    }
  }
  ExistenceModel model{Parameters{}};
  std::vector<Eigen::Vector3f> positions;
  std::vector<PointExistence<S>> points;
};

/// One frame: every point is looked at once, four of five are seen. time_per_point is what counts.
template <typename S>
void BM_Frame(benchmark::State& state) {
  ExistenceScene<S> scene(static_cast<std::size_t>(state.range(0)));
  std::uint32_t frame = 0;
  for (auto _ : state) {
    const float turn = 0.1F * static_cast<float>(++frame);
    const Eigen::Vector3f sensor(5.0F * std::cos(turn), 5.0F * std::sin(turn), 1.5F);
    std::uint32_t chance = frame;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      chance = chance * 1664525U + 1013904223U;
      const Look look{sensor - scene.positions[i]};
      if (chance > 0x33333333U)
        scene.points[i].hit(scene.model, look);
      else
        scene.points[i].miss(scene.model, look);
    }
    benchmark::DoNotOptimize(scene.points.data());
  }
  state.counters["time_per_point"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * static_cast<double>(state.range(0)),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["bytes_per_point"] = sizeof(PointExistence<S>);
}
BENCHMARK(BM_Frame<IcosahedralShell>)->Arg(1000)->Arg(100000)->Arg(1000000);
BENCHMARK(BM_Frame<VonMisesFisherShell<6>>)->Arg(1000)->Arg(1000000);

/// Time that passes for every point.
void BM_Elapse(benchmark::State& state) {
  ExistenceScene<IcosahedralShell> scene(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    const Elapsed second = scene.model.elapsed(1.0);
    for (auto& point : scene.points) point.elapse(scene.model, second);
    benchmark::DoNotOptimize(scene.points.data());
  }
  state.counters["time_per_point"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * static_cast<double>(state.range(0)),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Elapse)->Arg(1000000);

}  // namespace
