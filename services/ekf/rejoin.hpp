// Pairs new tracks with landmarks whose track was lost.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/ekf/gates.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/scan_update.hpp"

namespace understory::ekf {

/// Pairings of unknown tracks with lost landmarks, for update_compatible().
struct RejoinProposal {
  std::vector<Pairing> pairings;
  /// The scan's observations, with added noise for the heading's uncertainty, which the update
  /// linearises.
  std::vector<Observation> observations;
  int nodes = 0;  ///< Of the search.
};

/// Parameters of a search for lost landmarks.
struct RejoinRules {
  const EkfGateParameters& parameters;
  const Gates& gates;
  double min_separation_m = 0.0;  ///< Of landmarks of the map.
  int max_nodes = 0;              ///< Of nodes of the search tree.
};

/// The largest set of the scan's unsettled observations that is jointly compatible with lost
/// landmarks: not observed for `rejoin_after_scans` although in view. None if no landmark is lost,
/// or if the gates are wide and only few agree, which may be chance. `scan_number`: of this scan.
/// Of more than 256 unsettled observations the nearest ones are searched.
std::optional<RejoinProposal> find_rejoining(const FilterState& state,
                                             const model::TrackedScan& scan,
                                             const ScanUpdate& update, std::uint64_t scan_number,
                                             const RejoinRules& rules);

}  // namespace understory::ekf
