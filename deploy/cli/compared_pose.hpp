// Estimated and true poses of a recorded run, and measures of their errors.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/trajectory_error.hpp"
#include "common/model/landmarks.hpp"

namespace understory::cli {

/// A pose estimate and the truth of the same instant, frame world.
struct ComparedPose {
  model::Utime utime = 0;
  geometry::SE2 world_T_vehicle;
  geometry::SE2 true_world_T_vehicle;
  /// Covariance of the pose in its map, plus that of an inexact truth: tangent order x, y, theta
  /// [m, rad]; zero if not stated.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint32_t map_id = 1;
  std::int64_t log_utime = 0;  ///< Reception time in the log [us]; 0 for a keyframe.

  /// Distance between the two positions.
  double position_error_m() const;
};

double mean(const std::vector<double>& values);     ///< 0 for an empty list.
double maximum(const std::vector<double>& values);  ///< 0 for an empty list.
double rms(const std::vector<double>& values);      ///< 0 for an empty list.
/// Pairs for the measures of common/geometry/trajectory_error.
std::vector<geometry::PosePair> pairs_of(const std::vector<ComparedPose>& poses);
/// NEES of each pose with a covariance, from its error in the map, whose frame is fixed at the tie.
std::vector<double> nees_of(const std::vector<ComparedPose>& poses);
/// The position error of each pose.
std::vector<double> position_errors_m(const std::vector<ComparedPose>& poses);

}  // namespace understory::cli
