// Relative motion that no landmark has touched.
#pragma once

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory {

/// Channel ODOMETRY: motion of the vehicle between two stamps, from wheels or preintegrated IMU.
struct Odometry {
  Utime from_utime = 0;
  Utime utime = 0;  ///< End of the interval.
  std::uint64_t sequence = 0;
  SE2 from_T_to;
  /// Covariance of `from_T_to` (tangent order x, y, theta; right perturbation).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

}  // namespace understory
