// One revolution of a laser that scans a plane.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// Channels RAW_SCAN and LIDAR_SCAN, of a one-plane laser: beam k points at `first_bearing_rad` + k
/// * `bearing_step_rad` (frame `sensor`: 0 = straight ahead, left positive). A scan with beams at
/// different times is de-skewed to a LIDAR_SWEEP of one ring; LIDAR_SCAN has scans with all beams
/// at one time.
struct PlanarScan {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  double first_bearing_rad = 0.0;  ///< Bearing of beam 0.
  double bearing_step_rad = 0.0;   ///< Step between two beams; negative = clockwise.
  /// A range at or beyond this, or one that is not a positive number, is no return [m].
  double max_range_m = 0.0;
  std::vector<float> ranges_m;  ///< Per beam.
  /// Beam k is measured k times this interval after utime; 0 = all at once.
  double beam_interval_s = 0.0;
  geometry::SE2 vehicle_T_sensor;  ///< Pose of the laser in the plane; not known for RAW_SCAN.

  /// Direction of a beam [rad], frame `sensor`.
  double bearing(std::size_t beam) const {
    return first_bearing_rad + static_cast<double>(beam) * bearing_step_rad;
  }
  /// Time from the first beam to the last one [s].
  double duration_s() const {
    return ranges_m.empty() ? 0.0 : beam_interval_s * static_cast<double>(ranges_m.size() - 1);
  }
  /// Time of the last beam.
  Utime end() const { return utime + static_cast<Utime>(std::llround(duration_s() * 1e6)); }
  /// True where the beam hit something.
  bool is_return(std::size_t beam) const {
    return ranges_m[beam] > 0.0F && ranges_m[beam] < max_range_m;
  }
};

}  // namespace understory::model
