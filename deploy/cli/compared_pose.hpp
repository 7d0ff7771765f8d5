// Estimated poses of a recorded run beside the true ones, and measures of their errors.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/trajectory_error.hpp"
#include "common/model/landmarks.hpp"

namespace understory::cli {

/// A pose estimate beside the truth of the same instant, frame world.
struct ComparedPose {
  model::Utime utime = 0;
  geometry::SE2 world_T_vehicle;
  geometry::SE2 true_world_T_vehicle;
  /// Of the pose in its map, with that of the truth where it is not exact: tangent order x, y,
  /// theta [m, rad]; zero where none is stated.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint32_t map_id = 1;
  std::int64_t log_utime = 0;  ///< When the log received it [us]; 0 of a keyframe.

  /// Distance between the two positions.
  double position_error_m() const;
};

double mean(const std::vector<double>& values);     ///< 0 of none.
double maximum(const std::vector<double>& values);  ///< 0 of none.
double rms(const std::vector<double>& values);      ///< 0 of none.
/// For the measures of common/geometry/trajectory_error.
std::vector<geometry::PosePair> pairs_of(const std::vector<ComparedPose>& poses);
/// NEES of each pose that states a covariance: its error in the map, whose frame is held at the
/// tie, by that covariance.
std::vector<double> nees_of(const std::vector<ComparedPose>& poses);
/// The position error of each pose.
std::vector<double> position_errors_m(const std::vector<ComparedPose>& poses);

}  // namespace understory::cli
