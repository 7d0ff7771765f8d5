// Geometric hierarchy: time per change, per query, and how far polygons alone carry.
//   bench_hierarchy --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
// Set UNDERSTORY_BENCH_LARGE=1 for the map of 1.4 million landmarks (half a minute to set up).
#include "common/hierarchy/geometric_hierarchy.hpp"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <map>

#include "common/hierarchy/matching.hpp"
#include "tests/hierarchy/hierarchy_scene.hpp"

using namespace understory;

namespace {

constexpr std::int64_t kThesisMap = 13770;
constexpr std::int64_t kLargeMap = 1400000;

/// A forest with its hierarchy, which each benchmark leaves as it was. Made once per size.
struct Scene {
  explicit Scene(std::int64_t count)
      : random(static_cast<std::uint64_t>(count)),
        forest(test::random_forest(static_cast<std::size_t>(count), random)),
        hierarchy(forest) {}

  /// A place inside the forest.
  Eigen::Vector2d place() {
    const double half = 0.49 * std::sqrt(static_cast<double>(forest.size()) / 0.0122);
    std::uniform_real_distribution<double> coordinate(-half, half);
    return {coordinate(random), coordinate(random)};
  }
  geometry::SE2 pose() {
    const Eigen::Vector2d p = 0.9 * place();
    return {p.x(), p.y(), std::uniform_real_distribution<double>(-3.1, 3.1)(random)};
  }
  std::uint64_t any_id() { return 1 + random() % forest.size(); }

  std::mt19937_64 random;
  std::vector<hierarchy::LandmarkPosition> forest;
  hierarchy::GeometricHierarchy hierarchy;
};

Scene& scene(std::int64_t count) {
  static std::map<std::int64_t, Scene> scenes;
  return scenes.try_emplace(count, count).first->second;
}

bool too_large(benchmark::State& state) {
  if (state.range(0) >= kLargeMap && std::getenv("UNDERSTORY_BENCH_LARGE") == nullptr) {
    state.SkipWithError("set UNDERSTORY_BENCH_LARGE=1");
    return true;
  }
  return false;
}

/// The yardstick: triangulation alone, from scratch, in CGAL's own order.
void triangulate_from_scratch(benchmark::State& state) {
  const auto& forest = scene(kThesisMap).forest;
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(forest.size());
  for (const hierarchy::LandmarkPosition& landmark : forest) {
    positions.push_back(landmark.position_m);
  }

  for (auto _ : state) {
    hierarchy::Triangulation triangulation;
    hierarchy::TriangulationChange change;
    for (const std::uint32_t i : hierarchy::insertion_order(positions)) {
      triangulation.insert(forest[i].id, positions[i], change);
    }
    benchmark::DoNotOptimize(triangulation.triangle_count());
  }
}
BENCHMARK(triangulate_from_scratch)->Unit(benchmark::kMillisecond);

void build_from_scratch(benchmark::State& state) {
  if (too_large(state)) {
    return;
  }
  const auto& forest = scene(state.range(0)).forest;
  for (auto _ : state) {
    const hierarchy::GeometricHierarchy hierarchy(forest);
    benchmark::DoNotOptimize(hierarchy.polygon_count());
  }
}
BENCHMARK(build_from_scratch)->Arg(60)->Arg(kThesisMap)->Unit(benchmark::kMillisecond);

/// A landmark comes and goes: two changes per iteration.
void insert_and_remove(benchmark::State& state) {
  if (too_large(state)) {
    return;
  }
  Scene& world = scene(state.range(0));
  for (auto _ : state) {
    const std::uint64_t id = world.forest.size() + 1;
    world.hierarchy.insert(id, world.place());
    world.hierarchy.remove(id);
  }
  state.counters["per_change"] =
      benchmark::Counter(2.0 * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(insert_and_remove)->Arg(kThesisMap)->Arg(kLargeMap)->Unit(benchmark::kMicrosecond);

/// A landmark is shifted as the graph shifts them: by centimetres, there and back.
void move_a_little(benchmark::State& state) {
  if (too_large(state)) {
    return;
  }
  Scene& world = scene(state.range(0));
  for (auto _ : state) {
    const hierarchy::LandmarkPosition& landmark = world.forest[world.any_id() - 1];
    world.hierarchy.move(landmark.id, landmark.position_m + Eigen::Vector2d(0.03, -0.02));
    world.hierarchy.move(landmark.id, landmark.position_m);
  }
  state.counters["per_change"] =
      benchmark::Counter(2.0 * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(move_a_little)->Arg(kThesisMap)->Arg(kLargeMap)->Unit(benchmark::kMicrosecond);

void describe_polygon(benchmark::State& state) {
  const hierarchy::GeometricHierarchy& hierarchy = scene(kThesisMap).hierarchy;
  std::vector<Eigen::Vector2d> corners;
  for (const hierarchy::Polygon& polygon : hierarchy.polygons()) {
    if (polygon.boundary.size() == static_cast<std::size_t>(state.range(0))) {
      for (const std::uint32_t slot : polygon.boundary) {
        corners.push_back(hierarchy.triangulation().position(slot));
      }
      break;
    }
  }

  for (auto _ : state) {
    benchmark::DoNotOptimize(hierarchy::describe(corners, 20));
  }
}
BENCHMARK(describe_polygon)->Arg(4)->Arg(8);

/// Polygons within tau of one that is observed with 5 cm noise.
void query_index(benchmark::State& state) {
  if (too_large(state)) {
    return;
  }

  Scene& world = scene(state.range(0));
  const hierarchy::GeometricHierarchy view(
      observe(world.forest, world.pose(), test::View{}, world.random));
  std::vector<hierarchy::DescriptorIndex::Hit> hits;
  std::size_t next = 0;
  std::size_t found = 0;

  for (auto _ : state) {
    const hierarchy::Polygon& polygon = view.polygons()[next++ % view.polygons().size()];
    world.hierarchy.index().within(polygon.descriptor, 2.0F, hits);
    found += hits.size();
  }

  state.counters["hits"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}
BENCHMARK(query_index)->Arg(kThesisMap)->Arg(kLargeMap)->Unit(benchmark::kMicrosecond);

/// Polygons alone as a key to the map: views with noise [cm], detection [%] and clutter [%] (range
/// 0 ... 2) and tau (3). `found` is the part of the views with at least six right pairs, `right`
/// and `wrong` are pairs per view. The time is for hierarchy and matching of one view.
void match_views(benchmark::State& state) {
  if (too_large(state)) {
    return;
  }

  Scene& world = scene(state.range(0));
  const test::View view{.noise_m = 0.01 * static_cast<double>(state.range(1)),
                        .detection = 0.01 * static_cast<double>(state.range(2)),
                        .clutter = 0.01 * static_cast<double>(state.range(3))};
  const hierarchy::MatchParameters parameters{.max_descriptor_distance =
                                                  static_cast<double>(state.range(4))};
  constexpr std::size_t kViews = 100;
  std::vector<std::vector<hierarchy::LandmarkPosition>> views;
  std::mt19937_64 random(7);
  world.random.seed(8);

  for (std::size_t i = 0; i < kViews; ++i) {
    views.push_back(observe(world.forest, world.pose(), view, random));
  }

  std::size_t right = 0;
  std::size_t wrong = 0;
  std::size_t found = 0;
  std::size_t next = 0;

  for (auto _ : state) {
    const hierarchy::GeometricHierarchy query(views[next++ % kViews]);
    const auto pairs = match(query, world.hierarchy, parameters);
    std::size_t right_here = 0;
    for (const hierarchy::LandmarkMatch& pair : pairs) {
      right_here += pair.query_id == pair.map_id ? 1 : 0;
    }
    right += right_here;
    wrong += pairs.size() - right_here;
    found += right_here >= 6 ? 1 : 0;
  }

  const auto n = static_cast<double>(state.iterations());
  state.counters["found"] = static_cast<double>(found) / n;
  state.counters["right"] = static_cast<double>(right) / n;
  state.counters["wrong"] = static_cast<double>(wrong) / n;
}
BENCHMARK(match_views)
    ->ArgNames({"map", "noise_cm", "detection", "clutter", "tau"})
    ->ArgsProduct({{kThesisMap}, {5, 10, 20}, {100, 90, 80}, {0}, {2, 4, 8}})
    ->Args({kThesisMap, 20, 60, 50, 8})
    ->Args({kLargeMap, 5, 90, 0, 2})
    ->Iterations(200)
    ->Unit(benchmark::kMillisecond);

}  // namespace
