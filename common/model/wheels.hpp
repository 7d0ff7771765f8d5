// One sample of a car's wheels.
#pragma once

#include <cstdint>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Channel WHEELS: speed at the encoder's wheel and steering of the equivalent bicycle's front
/// wheel.
struct WheelSample {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  double speed_mps = 0.0;     ///< Speed of the wheel with the encoder; backwards negative.
  double steering_rad = 0.0;  ///< Left positive.
};

}  // namespace understory::model
