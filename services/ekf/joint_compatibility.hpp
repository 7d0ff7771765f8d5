// Association of unknown tracks with landmarks of the map: joint compatibility branch and bound
// (Neira & Tardos 2001).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

/// Limits of a search for joint compatibility.
struct CompatibilityGates {
  /// Largest squared Mahalanobis distance by number of pairings (set_gates()), up to the number of
  /// observations.
  std::span<const double> limits;
  /// Limit of visited nodes plus tested pairings; beyond it the best set found so far is returned.
  int max_nodes = 2000;
};

/// Result of the search, and its cost.
struct CompatibleSet {
  std::vector<Pairing> pairings;
  int nodes = 0;  ///< Visited nodes plus tested pairings.
};

/// An observation and the landmarks that may match it individually, the most likely first.
struct Candidates {
  std::uint32_t observation = 0;
  std::vector<std::uint32_t> landmarks;
};

/// The largest one-to-one set of pairings whose innovations are compatible together; of sets of one
/// size the one with the smallest squared distance. Exponential in the number of candidates in the
/// worst case, therefore bounded by `max_nodes`.
CompatibleSet joint_compatibility(const FilterState& state,
                                  std::span<const Observation> observations,
                                  std::span<const Candidates> candidates,
                                  const CompatibilityGates& gates);

}  // namespace understory::ekf
