// What the viewer's process pays for its pages.
#include <benchmark/benchmark.h>

#include <nlohmann/json.hpp>
#include <random>

#include "services/viewer/scene_frame.hpp"

namespace {

using namespace understory;

model::MapLandmark landmark(model::LandmarkId id, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(0.0, 10'000.0);
  model::MapLandmark one;
  one.id = id;
  one.position_m = {place(random), place(random)};
  one.covariance_m2 = 1e-3 * Eigen::Matrix2d::Identity();
  one.radius_m = 0.2;
  return one;
}

/// A map of so many landmarks in `scene`.
void fill(viewer::Scene& scene, std::size_t landmarks, std::mt19937_64& random) {
  model::MapDelta delta;
  delta.version = 1;
  for (model::LandmarkId id = 1; id <= landmarks; ++id) delta.added.push_back(landmark(id, random));
  scene.take(delta);
}

/// All that a page which just came gets.
void whole_map(benchmark::State& state) {
  std::mt19937_64 random(1);
  viewer::Scene scene;
  fill(scene, static_cast<std::size_t>(state.range(0)), random);
  std::size_t bytes = 0;
  for (auto _ : state) {
    viewer::SceneCursor cursor;
    bytes = 0;
    while (viewer::has_news(scene, cursor))
      bytes += viewer::make_frame(scene, {}, {}, cursor)->size();
  }
  state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
}
BENCHMARK(whole_map)->Arg(200)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

/// A keyframe that changed 40 landmarks, a pose, and the frame that tells of both.
void keyframe_and_pose(benchmark::State& state) {
  std::mt19937_64 random(2);
  viewer::Scene scene;
  fill(scene, static_cast<std::size_t>(state.range(0)), random);
  viewer::SceneCursor cursor;
  while (viewer::has_news(scene, cursor)) viewer::make_frame(scene, {}, {}, cursor);

  model::MapDelta delta;
  delta.version = 1;
  model::SlamPose pose;
  pose.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  for (auto _ : state) {
    delta.base_version = delta.version++;
    delta.moved.clear();
    for (int i = 0; i < 40; ++i)
      delta.moved.push_back(
          landmark(1 + random() % static_cast<std::uint64_t>(state.range(0)), random));
    scene.take(delta);
    pose.utime += 100'000;
    scene.take(pose, pose.utime);
    benchmark::DoNotOptimize(viewer::make_frame(scene, {}, {}, cursor));
  }
}
BENCHMARK(keyframe_and_pose)->Arg(200)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMicrosecond);

}  // namespace
