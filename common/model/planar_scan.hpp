// One revolution of a laser that sweeps a plane.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Channel LIDAR_SCAN from a one-plane laser: beam k points at `first_bearing_rad` + k *
/// `bearing_step_rad` (frame `sensor`: 0 = straight ahead, left positive).
struct PlanarScan {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  double first_bearing_rad = 0.0;  ///< Of beam 0.
  double bearing_step_rad = 0.0;   ///< Between two beams; negative = clockwise.
  /// A range at or beyond this, or one that is not a positive number, is no return [m].
  double max_range_m = 0.0;
  std::vector<float> ranges_m;  ///< Per beam.

  /// Direction of a beam [rad], frame `sensor`.
  double bearing(std::size_t beam) const {
    return first_bearing_rad + static_cast<double>(beam) * bearing_step_rad;
  }
  /// True where the beam hit something.
  bool is_return(std::size_t beam) const {
    return ranges_m[beam] > 0.0F && ranges_m[beam] < max_range_m;
  }
};

}  // namespace understory::model
