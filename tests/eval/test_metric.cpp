#include <cmath>
#include <numbers>

#include "eval/metrics/metric.hpp"
#include "tests/catch.hpp"
#include "tests/eval/small_drive.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

/// A pose whose position is off by `offset` metres in the frame of the map.
eval::metrics::PoseEstimate displaced(const eval::metrics::MapTruth& truth, std::size_t scan,
                                      const Eigen::Vector2d& offset, double turned_rad = 0.0) {
  const geometry::SE2 pose = truth.map_T_vehicle(scan);
  return {scan, geometry::SE2(pose.translation() + offset, pose.theta() + turned_rad)};
}

}  // namespace

TEST_CASE("RPE, ROE and LPE of two states, by hand", "[metric]") {
  const sim::Drive drive(test::small_drive_parameters(), 1);
  const eval::metrics::MapTruth truth(drive, 4);
  CHECK(truth.map_T_vehicle(4).Log().norm() < 1e-12);
  const std::uint32_t a = truth.trunks_in_range()[0];
  const std::uint32_t b = truth.trunks_in_range()[1];

  eval::metrics::MapState first;
  first.poses = {displaced(truth, 4, {0, 0})};
  first.landmarks_m = {truth.trunk_m(a) + Eigen::Vector2d(0.1, 0.0)};
  eval::metrics::MapState second = first;
  second.poses.push_back(displaced(truth, 12, {0.3, 0.4}, -0.01));
  second.landmarks_m.push_back(truth.trunk_m(b) + Eigen::Vector2d(0.0, -0.4));

  eval::metrics::ErrorSums run = errors_of(first, truth);
  run += errors_of(second, truth);
  // Poses 0 | 0, 0.5 m; landmarks 0.1 | 0.1, 0.4 m.
  CHECK(run.rpe_m() == Approx(0.5 / 3.0));
  CHECK(run.roe_rad() == Approx(0.01 / 3.0));
  CHECK(run.lpe_m() == Approx(0.6 / 3.0));
  CHECK(eval::metrics::ErrorSums{}.rpe_m() == 0.0);
}

TEST_CASE("A landmark is compared with the nearest trunk that was ever in range", "[metric]") {
  sim::Forest forest;
  forest.high_m = {400.0, 400.0};
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) forest.trunks_m.emplace_back(20.0 * i, 20.0 * j);
  }
  forest.radii_m.assign(forest.trunks_m.size(), 0.0);

  const sim::Drive drive(test::small_drive_parameters(), forest, 3);
  const eval::metrics::MapTruth truth(drive, 0);

  REQUIRE(truth.trunks_in_range().size() < forest.trunks_m.size());
  for (const std::uint32_t trunk : truth.trunks_in_range()) {
    const auto nearest = truth.nearest_trunk(truth.trunk_m(trunk));
    REQUIRE(nearest.index == trunk);
    REQUIRE(nearest.distance_m < 1e-9);
    double to_path = INFINITY;
    for (const geometry::SE2& pose : drive.world_T_vehicle()) {
      to_path = std::min(to_path, (pose.translation() - forest.trunks_m[trunk]).norm());
    }
    REQUIRE(to_path <= 40.0);
  }
}

TEST_CASE("ATE does not see a rigid motion of the whole, and measures the rest", "[metric]") {
  const sim::Drive drive(test::small_drive_parameters(40.0), 2);
  const eval::metrics::MapTruth truth(drive, 0);
  std::vector<eval::metrics::PoseEstimate> poses;
  const geometry::SE2 moved(3.0, -1.0, 0.3);
  for (std::size_t scan = 0; scan < drive.size(); scan += 8) {
    poses.push_back({scan, moved * truth.map_T_vehicle(scan)});
  }
  CHECK(absolute_trajectory_error(poses, truth) < 1e-9);
  // Every second pose to the left, the others to the right by d: alignment cannot take it out.
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double side = i % 2 == 0 ? 0.05 : -0.05;
    poses[i].map_T_vehicle = poses[i].map_T_vehicle * geometry::SE2(0.0, side, 0.0);
  }
  CHECK(absolute_trajectory_error(poses, truth) == Approx(0.05).epsilon(0.05));
}

TEST_CASE("Doubled and invented landmarks are false, missing ones lower the recall", "[metric]") {
  const sim::Drive drive(test::small_drive_parameters(), 1);
  const eval::metrics::MapTruth truth(drive, 0);

  std::vector<std::uint32_t> observation_count(drive.forest().trunks_m.size(), 0);
  std::vector<Eigen::Vector2d> landmarks;
  for (const std::uint32_t trunk : truth.trunks_in_range()) {
    observation_count[trunk] = 20;
    landmarks.push_back(truth.trunk_m(trunk) + Eigen::Vector2d(0.05, 0.0));
  }

  const std::size_t trunks = landmarks.size();
  observation_count[truth.trunks_in_range()[0]] = 19;  // too few observations to be counted
  landmarks.push_back(landmarks[1] + Eigen::Vector2d(0.01, 0.0));
  landmarks.emplace_back(1000.0, 1000.0);
  landmarks.erase(landmarks.begin() + 2);

  const eval::metrics::MapCompleteness result =
      map_completeness(landmarks, truth, observation_count);

  CHECK(result.well_seen == trunks - 1);
  CHECK(result.recalled == trunks - 2);
  CHECK(result.landmarks == trunks + 1);
  CHECK(result.without_trunk == 2);
}
