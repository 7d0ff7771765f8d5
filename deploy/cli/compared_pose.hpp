// Estimated poses of a recorded run beside the true ones, and measures of their errors.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/trajectory_error.hpp"
#include "common/model/landmarks.hpp"

namespace understory::cli {

/// How well the truth is known itself: standard deviations of each of its poses, 0 = exact.
struct TruthSigma {
  double position_m = 0.0;  ///< Per axis.
  double heading_rad = 0.0;
};
/// The covariance that the truth's own errors add to that of a pose's error (tangent of the
/// vehicle; x, y, theta [m, rad]): those of this pose, and those of the true pose to which the map
/// is tied, moved to here. `tie_T_vehicle`: from that pose to this one; none where the map is tied
/// by many poses, whose errors average out.
Eigen::Matrix3d covariance_of_truth(const TruthSigma& sigma,
                                    const std::optional<geometry::SE2>& tie_T_vehicle);

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
  /// Absolute difference of the headings.
  double heading_error_rad() const;
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
