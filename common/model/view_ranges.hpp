// Free range around the sensor, and the line of sight to an undetected landmark.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Channel VIEW_RANGES: free range at the height of trunks in one sweep, frame `vehicle_level` at
/// utime.
///
/// Bin i is the sector of bearings from `first_bearing_rad + i * step_rad` on, from sensor_at(i),
/// because the sensor rotates and moves during the sweep.
struct ViewRanges {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  /// Position of the sensor at utime, the end of the revolution.
  Eigen::Vector2d sensor_m = Eigen::Vector2d::Zero();
  /// Its motion during the revolution; 0 = unknown.
  Eigen::Vector2d turn_m = Eigen::Vector2d::Zero();
  double first_bearing_rad = 0.0;  ///< Left positive.
  double step_rad = 0.0;           ///< Width of a bin; negative = bins proceed to the right.
  double beam_step_rad = 0.0;      ///< Angle between beams, seen from above.
  double range_step_m = 0.25;      ///< Unit of the ranges.
  /// Range up to which beams passed without a return; 0 = unknown.
  std::vector<std::uint8_t> free;
  /// Range from which an object hides the view; 0 = no object, or unknown.
  std::vector<std::uint8_t> hidden;

  /// Position of the sensor when it measured a bin.
  Eigen::Vector2d sensor_at(std::size_t bin) const {
    const double done = (static_cast<double>(bin) + 0.5) / static_cast<double>(free.size());
    return sensor_m - (1.0 - done) * turn_m;
  }
};

/// Line of sight to an undetected landmark (frame `vehicle_level`), from the bins over its width
/// plus 0.15 m on each side. Clear: all known bins are free beyond it, and a trunk of this radius
/// would have stopped at least two adjacent beams. Blocked: in at least half of the known bins
/// beams end at its position or before. `radius_m`: 0 = unknown, treated as thin.
LineOfSight line_of_sight(const ViewRanges& ranges, const Eigen::Vector2d& place_m,
                          double radius_m);

}  // namespace understory::model
