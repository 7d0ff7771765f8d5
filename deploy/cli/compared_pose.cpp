#include "deploy/cli/compared_pose.hpp"

#include <algorithm>
#include <cmath>

namespace understory::cli {

double ComparedPose::position_error_m() const {
  return (world_T_vehicle.translation() - true_world_T_vehicle.translation()).norm();
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double maximum(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

std::vector<geometry::PosePair> pairs_of(const std::vector<ComparedPose>& poses) {
  std::vector<geometry::PosePair> pairs;
  pairs.reserve(poses.size());
  for (const auto& pose : poses)
    pairs.push_back({pose.world_T_vehicle, pose.true_world_T_vehicle, pose.map_id});
  return pairs;
}

std::vector<double> nees_of(const std::vector<ComparedPose>& poses) {
  std::vector<double> values;
  for (const auto& pose : poses) {
    const auto value =
        geometry::nees({pose.world_T_vehicle, pose.true_world_T_vehicle}, pose.covariance);
    if (value) values.push_back(*value);
  }
  return values;
}

std::vector<double> position_errors_m(const std::vector<ComparedPose>& poses) {
  std::vector<double> errors;
  errors.reserve(poses.size());
  for (const auto& pose : poses) errors.push_back(pose.position_error_m());
  return errors;
}

}  // namespace understory::cli
