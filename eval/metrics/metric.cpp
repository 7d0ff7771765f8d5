#include "eval/metrics/metric.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "common/geometry/trajectory_error.hpp"

namespace understory::eval::metrics {
namespace {

constexpr double kTile = 5.0;
constexpr double kPairing = 1.0;  // [m] largest distance of a landmark to its trunk

std::vector<std::uint32_t> trunks_ever_in_range(const sim::Drive& drive) {
  std::vector<bool> in_range(drive.forest().trunks_m.size(), false);
  for (const geometry::SE2& pose : drive.world_T_vehicle()) {
    for (const std::uint32_t trunk :
         drive.grid().within(pose.translation(), drive.parameters().sensor.range_m)) {
      in_range[trunk] = true;
    }
  }
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < in_range.size(); ++i) {
    if (in_range[i]) indices.push_back(i);
  }
  return indices;
}

double ratio(double sum, std::size_t count) {
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

}  // namespace

MapTruth::MapTruth(const sim::Drive& drive, std::size_t base)
    : MapTruth(drive.world_T_vehicle(), base, drive.forest().trunks_m,
               trunks_ever_in_range(drive)) {}

MapTruth::MapTruth(std::vector<geometry::SE2> world_T_vehicle, std::size_t base,
                   std::vector<Eigen::Vector2d> trunks_m, std::vector<std::uint32_t> in_range)
    : map_T_world_(world_T_vehicle[base].inverse()),
      world_T_vehicle_(std::move(world_T_vehicle)),
      trunks_m_(std::move(trunks_m)),
      in_range_(std::move(in_range)),
      grid_(trunks_m_, kTile) {}

sim::PointGrid::Neighbour MapTruth::nearest_trunk(const Eigen::Vector2d& point_in_map_m) const {
  const auto nearest = grid_.nearest(map_T_world_.inverse() * point_in_map_m);
  if (!nearest) return {0, INFINITY};
  return *nearest;
}

std::vector<std::uint32_t> MapTruth::trunks_within(const Eigen::Vector2d& point_in_map_m,
                                                   double radius_m) const {
  return grid_.within(map_T_world_.inverse() * point_in_map_m, radius_m);
}

ErrorSums& ErrorSums::operator+=(const ErrorSums& other) {
  position_m += other.position_m;
  heading_rad += other.heading_rad;
  poses += other.poses;
  landmark_m += other.landmark_m;
  landmarks += other.landmarks;
  return *this;
}

double ErrorSums::rpe_m() const { return ratio(position_m, poses); }
double ErrorSums::roe_rad() const { return ratio(heading_rad, poses); }
double ErrorSums::lpe_m() const { return ratio(landmark_m, landmarks); }

ErrorSums errors_of(const MapState& state, const MapTruth& truth) {
  ErrorSums sums;
  for (const PoseEstimate& pose : state.poses) {
    const geometry::SE2 true_pose = truth.map_T_vehicle(pose.scan);
    sums.position_m += (pose.map_T_vehicle.translation() - true_pose.translation()).norm();
    sums.heading_rad +=
        std::abs(geometry::wrap_angle(pose.map_T_vehicle.theta() - true_pose.theta()));
  }
  for (const Eigen::Vector2d& landmark : state.landmarks_m) {
    sums.landmark_m += truth.nearest_trunk(landmark).distance_m;
  }
  sums.poses = state.poses.size();
  sums.landmarks = state.landmarks_m.size();
  return sums;
}

double absolute_trajectory_error(std::span<const PoseEstimate> poses, const MapTruth& truth) {
  std::vector<geometry::PosePair> pairs;
  pairs.reserve(poses.size());
  for (const PoseEstimate& pose : poses)
    pairs.push_back({pose.map_T_vehicle, truth.map_T_vehicle(pose.scan)});
  const auto error = geometry::aligned_error(pairs);
  return error ? error->rms_m : 0.0;
}

MapCompleteness map_completeness(std::span<const Eigen::Vector2d> landmarks_m,
                                 const MapTruth& truth,
                                 std::span<const std::uint32_t> observation_count_of_trunk,
                                 std::uint32_t min_observation_count) {
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t landmark = 0; landmark < landmarks_m.size(); ++landmark) {
    for (const std::uint32_t trunk : truth.trunks_within(landmarks_m[landmark], kPairing)) {
      pairs.emplace_back((landmarks_m[landmark] - truth.trunk_m(trunk)).norm(), trunk, landmark);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<bool> trunk_taken(observation_count_of_trunk.size(), false);
  std::vector<bool> landmark_taken(landmarks_m.size(), false);
  for (const auto& [distance, trunk, landmark] : pairs) {
    if (trunk_taken[trunk] || landmark_taken[landmark]) continue;
    trunk_taken[trunk] = landmark_taken[landmark] = true;
  }
  MapCompleteness result;
  result.landmarks = landmarks_m.size();
  result.without_trunk =
      static_cast<std::size_t>(std::count(landmark_taken.begin(), landmark_taken.end(), false));
  for (std::size_t trunk = 0; trunk < observation_count_of_trunk.size(); ++trunk) {
    if (observation_count_of_trunk[trunk] < min_observation_count) continue;
    ++result.well_seen;
    if (trunk_taken[trunk]) ++result.recalled;
  }
  return result;
}

}  // namespace understory::eval::metrics
