// Effect of roll and pitch errors on a position in `vehicle_level`.
#pragma once

#include <Eigen/Core>

namespace understory::landmark_extractor::trunks {

/// Covariance [m^2] of a position, from that of (roll, pitch) [rad^2] used for its levelling.
inline Eigen::Matrix3d from_level_error(const Eigen::Vector3d& place_m,
                                        const Eigen::Matrix2d& level_covariance_rad2) {
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << 0.0, place_m.z(),  //
      -place_m.z(), 0.0,         //
      place_m.y(), -place_m.x();
  return jacobian * level_covariance_rad2 * jacobian.transpose();
}

}  // namespace understory::landmark_extractor::trunks
