// Which landmarks of the map the observations of unknown tracks may be: joint compatibility branch
// and bound (Neira & Tardos 2001).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

/// Limits of a search for joint compatibility.
struct CompatibilityGates {
  /// Largest squared Mahalanobis distance by number of pairings (set_gates()), for as many as there
  /// are observations.
  std::span<const double> limits;
  /// Nodes visited and pairings tried at most; after these the best set found so far is taken.
  int max_nodes = 2000;
};

/// What the search found, and what it cost.
struct CompatibleSet {
  std::vector<Pairing> pairings;
  int nodes = 0;  ///< Visited, and pairings tried.
};

/// An observation and the landmarks that it may be by itself, the most likely first.
struct Candidates {
  std::uint32_t observation = 0;
  std::vector<std::uint32_t> landmarks;
};

/// The largest set of pairings, one to one, whose innovations are compatible together; among sets
/// of one size the one with the smallest squared distance. Exponential in the number of candidates
/// in the worst case, therefore bounded by `max_nodes`.
CompatibleSet joint_compatibility(const FilterState& state,
                                  std::span<const Observation> observations,
                                  std::span<const Candidates> candidates,
                                  const CompatibilityGates& gates);

}  // namespace understory::ekf
