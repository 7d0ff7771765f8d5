// Odometry between the centres of two keyframes.
#pragma once

#include <optional>

#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The gyro's bias as measured while the vehicle was stationary.
struct MeasuredBias {
  double bias = 0.0;      ///< [rad/s]
  double variance = 0.0;  ///< [(rad/s)^2]
};

/// Motion from a node's centre to the centre of a later keyframe.
struct CentreMotion {
  NodeIndex from = 0;
  model::Utime utime = 0;                 ///< Of the later keyframe's base.
  geometry::SE2WithCovariance from_T_to;  ///< Right perturbation.
  /// The same rotation from the gyro alone. None without an IMU, and while the vehicle was
  /// stationary.
  std::optional<model::GyroRotation> gyro;
  double odometry_bias = 0.0;  ///< Bias that odometry now subtracts from the gyro's rate [rad/s].
  /// From the stops since the last such motion; none without a stop.
  std::optional<MeasuredBias> at_stops;
};

}  // namespace understory::geoslam_mapper::smoothing
