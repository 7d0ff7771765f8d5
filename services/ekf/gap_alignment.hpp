// Where the vehicle is after an interval without odometry.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "services/ekf/scan_update.hpp"

namespace understory::ekf {

/// The vehicle's pose as one scan shows it in the map, without any prediction.
struct GapAlignment {
  geometry::SE2 anchor_T_vehicle;  ///< From the state's anchor.
  std::vector<Pairing> pairings;   ///< What it rests on.
};

/// Finds the vehicle by landmarks whose tracks continue (`known`), where most of them agree on one
/// pose; else by the constellation of all landmarks (common/constellation), at most `radius_m` from
/// the prediction. None where neither is sure.
std::optional<GapAlignment> align_after_gap(const FilterState& state, const ScanUpdate& update,
                                            std::span<const Pairing> known, double radius_m);

/// Moves the vehicle's estimate to a pose from the state's anchor, as if the prediction over the
/// gap had led there: the velocity rotates with the vehicle, variances stay, and the errors of a
/// right invariant state are expressed at the new place. O(size).
void move_vehicle(FilterState& state, const geometry::SE2& anchor_T_vehicle);

}  // namespace understory::ekf
