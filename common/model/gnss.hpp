// A fix of satellite navigation, in a local plane.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/landmarks.hpp"

namespace understory {

/// Channel GNSS: a reference for evaluation, never used for mapping.
struct GnssFix {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector2d east_north_m = Eigen::Vector2d::Zero();  ///< From the recording's origin.
};

}  // namespace understory
