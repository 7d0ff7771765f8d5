// Localisation of the vehicle after an interval without odometry.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "services/ekf/scan_update.hpp"

namespace understory::ekf {

/// The vehicle's pose in the map from one scan, without any prediction.
struct GapAlignment {
  geometry::SE2 anchor_T_vehicle;  ///< Relative to the state's anchor.
  std::vector<Pairing> pairings;   ///< The pairings used for it.
};

/// Localises the vehicle by landmarks whose tracks continue (`known`), if most of them agree on one
/// pose; else by the constellation of all landmarks (common/constellation), at most `radius_m` from
/// the prediction. None if neither is certain.
std::optional<GapAlignment> align_after_gap(const FilterState& state, const ScanUpdate& update,
                                            std::span<const Pairing> known, double radius_m);

/// Moves the vehicle's estimate to a pose relative to the state's anchor, as if it had been
/// predicted over the gap: the velocity rotates with the vehicle, variances stay, and the errors of
/// a right invariant state are expressed at the new pose. O(size).
void move_vehicle(FilterState& state, const geometry::SE2& anchor_T_vehicle);

}  // namespace understory::ekf
