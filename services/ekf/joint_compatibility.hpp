// Which landmarks of the map the sightings of unknown tracks may be: joint compatibility branch and
// bound (Neira & Tardos 2001).
#pragma once

#include <span>
#include <vector>

#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

struct CompatibilityGates {
  double probability = 0.99;
  int max_nodes = 2000;  ///< Of the search; then the best set found so far is taken.
};

/// A sighting and the landmarks that it may be by itself, the most likely first.
struct Candidates {
  std::uint32_t observation = 0;
  std::vector<std::uint32_t> landmarks;
};

/// The largest set of pairings, one to one, whose innovations are compatible together; among equals
/// the one with the least squared distance.
std::vector<Pairing> joint_compatibility(const FilterState& state,
                                         std::span<const Observation> observations,
                                         std::span<const Candidates> candidates,
                                         const CompatibilityGates& gates);

}  // namespace understory::ekf
