// The pose of an observation from its pairs.
#include "common/constellation/pose.hpp"

#include <algorithm>
#include <random>

#include "tests/catch.hpp"

using namespace understory;
using namespace understory::constellation;

namespace {

constexpr std::uint32_t kPoints = 8;

struct Scene {
  PointGrid grid{8.0};
  PreparedObservation observation;
  std::vector<Pair> truth;
};

/// Eight landmarks, each seen once, slots in another order than the points.
Scene seen_scene(const LocaliseParameters& parameters) {
  const geometry::SE2 map_T_sensor(40.0, -7.0, 0.9);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  std::normal_distribution<double> noise(0.0, 0.05);

  Scene scene;
  std::vector<ObservedPoint> points;
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    const Eigen::Vector2d point(place(random), place(random));
    const Slot slot = (3 * i) % kPoints;
    scene.grid.insert(slot, map_T_sensor * point);
    points.push_back({point + Eigen::Vector2d(noise(random), noise(random)), 0.05});
    scene.truth.push_back({i, slot, 0.0});
  }
  scene.observation = prepare(points, parameters);
  return scene;
}

}  // namespace

TEST_CASE("Three pairs grow to the pose of all points", "[constellation]") {
  const LocaliseParameters parameters;
  const Scene scene = seen_scene(parameters);
  const FittedPose whole = fit_pose(scene.observation, scene.grid, scene.truth, parameters);
  const FittedPose grown = fit_pose(scene.observation, scene.grid,
                                    {scene.truth.begin(), scene.truth.begin() + 3}, parameters);

  REQUIRE(whole.pairs.size() == kPoints);
  REQUIRE((grown.map_T_sensor.inverse() * whole.map_T_sensor).Log().norm() < 1e-12);
  REQUIRE(std::equal(
      grown.pairs.begin(), grown.pairs.end(), scene.truth.begin(), scene.truth.end(),
      [](const Pair& a, const Pair& b) { return a.point == b.point && a.slot == b.slot; }));
}

TEST_CASE("Poses are the same where most of their pairs are", "[constellation]") {
  const LocaliseParameters parameters;
  const Scene scene = seen_scene(parameters);
  FittedPose whole;
  whole.pairs = scene.truth;
  FittedPose other = whole;
  for (std::uint32_t i = 0; i < 4; ++i) other.pairs[i].slot = scene.truth[i + 1].slot;
  REQUIRE(!same_pose(whole, other));
  other.pairs[0].slot = whole.pairs[0].slot;
  REQUIRE(same_pose(whole, other));

  FittedPose later;  // Of the pairs of the last points only.
  later.pairs.assign(scene.truth.begin() + 5, scene.truth.end());
  REQUIRE(same_pose(whole, later));
  REQUIRE(same_pose(later, whole));
}
