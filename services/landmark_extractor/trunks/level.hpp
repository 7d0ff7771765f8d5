// What an error of roll and pitch does to a place in `vehicle_level`.
#pragma once

#include <Eigen/Core>

namespace understory::landmark_extractor::trunks {

/// Covariance of a place that was turned by an attitude with covariance of (roll, pitch) [rad^2].
inline Eigen::Matrix3d from_level_error(const Eigen::Vector3d& place_m,
                                        const Eigen::Matrix2d& level_covariance_rad2) {
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << 0.0, place_m.z(),  //
      -place_m.z(), 0.0,         //
      place_m.y(), -place_m.x();
  return jacobian * level_covariance_rad2 * jacobian.transpose();
}

}  // namespace understory::landmark_extractor::trunks
