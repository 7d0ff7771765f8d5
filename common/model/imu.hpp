// One sample of an inertial measurement unit.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Channel IMU in frame `vehicle` (x forward, y left, z up); channel RAW_IMU in frame `sensor`,
/// uncorrected.
struct ImuSample {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  ///< At rest (0, 0, +9.81).
};

}  // namespace understory::model
