// Landmarks whose track was lost, and the new tracks that may be them.
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
  /// The scan's observations with noise for the heading's uncertainty, which the update linearises.
  std::vector<Observation> observations;
  int nodes = 0;  ///< Of the search.
};

/// What a search for lost landmarks takes from the filter.
struct RejoinRules {
  const EkfGateParameters& parameters;
  const Gates& gates;
  double min_separation_m = 0.0;  ///< Of landmarks of the map.
  int max_nodes = 0;              ///< Of the search.
};

/// The largest set of the scan's unsettled observations that is compatible with landmarks which
/// were not observed for `rejoin_after_scans` though the scan could show them (joint
/// compatibility). None where no landmark is lost, or where the gates are wide and few agree: by
/// chance. `scan_number`: of this scan. Of more than 256 unsettled observations the nearest ones
/// are searched.
std::optional<RejoinProposal> find_rejoining(const FilterState& state,
                                             const model::TrackedScan& scan,
                                             const ScanUpdate& update, std::uint64_t scan_number,
                                             const RejoinRules& rules);

}  // namespace understory::ekf
