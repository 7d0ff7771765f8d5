// How far the sensor saw around it, and what that says of a place where nothing was detected.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Channel VIEW_RANGES: how far the sensor saw at the height of trunks in one sweep, frame
/// `vehicle_level` at utime.
///
/// Bin i is the sector of bearings from `first_bearing_rad + i * step_rad` on, as seen from
/// sensor_at(i): the sensor turned, and moved, while it measured.
struct ViewRanges {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector2d sensor_m = Eigen::Vector2d::Zero();  ///< At utime, the end of the revolution.
  Eigen::Vector2d turn_m = Eigen::Vector2d::Zero();    ///< How far it moved in it; 0 = not known.
  double first_bearing_rad = 0.0;                      ///< Left positive.
  double step_rad = 0.0;       ///< Width of a bin; negative = they go to the right.
  double beam_step_rad = 0.0;  ///< From beam to beam, seen from above.
  double range_step_m = 0.25;  ///< Unit of the ranges.
  /// Up to here beams passed and met nothing; 0 = not known.
  std::vector<std::uint8_t> free;
  /// From here on nothing was seen, for something stands there; 0 = nowhere, or not known.
  std::vector<std::uint8_t> hidden;

  /// Where the sensor was when it looked into a bin.
  Eigen::Vector2d sensor_at(std::size_t bin) const {
    const double done = (static_cast<double>(bin) + 0.5) / static_cast<double>(free.size());
    return sensor_m - (1.0 - done) * turn_m;
  }
};

/// What the ranges say of the ray to a landmark (frame `vehicle_level`) that was not detected, by
/// the bins from side to side of it and 0.15 m beyond. Clear: all that are known say so, and a
/// trunk of that radius would have stopped two beams side by side at least. Blocked: in half of
/// them all ended at its place or before. `radius_m`: 0 = unknown, taken as thin.
LineOfSight line_of_sight(const ViewRanges& ranges, const Eigen::Vector2d& place_m,
                          double radius_m);

}  // namespace understory::model
