// What odometry measured between the centres of two keyframes.
#pragma once

#include <optional>

#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Motion from a node's centre to the centre of a later keyframe.
struct CentreMotion {
  NodeIndex from = 0;
  model::Utime utime = 0;                 ///< Of the later keyframe's base.
  geometry::SE2WithCovariance from_T_to;  ///< Right perturbation.
  /// The same rotation by the gyro alone. None without an IMU, and while the vehicle was
  /// stationary.
  std::optional<model::GyroRotation> gyro;
  std::optional<model::FilterBias> filter_bias;  ///< As the filter knows it at `utime`.
};

}  // namespace understory::geoslam_mapper::smoothing
