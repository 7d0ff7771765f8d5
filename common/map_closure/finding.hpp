// Finds the relative pose of two parts of a map from their landmarks.
#pragma once

#include <functional>

#include "common/map_closure/closing.hpp"
#include "common/map_merge/alignment.hpp"

namespace understory::map_closure {

/// Result of the search. All but `alignment.outcome` belongs to the best motion, also where it was
/// not accepted.
struct FoundClosure {
  map_merge::Alignment alignment;
  geometry::SE2WithCovariance from_T_to;  ///< Includes the own error of a place.
  double reach_m = 0.0;  ///< Length of path to both sides whose landmarks were used.
};

/// Looks for the landmarks of the one part among those of the other (map_merge::align), with no
/// prior, first of the two parts alone, then with the landmarks up to 30, 60 and 120 m further
/// along the path, but at most to half the way to the other part. The probability of an accepted
/// motion by chance is below 10^-9 over the whole search. Each place has an own error (5 cm, 3
/// mrad; docs/decisions/093) beside the error from the landmarks. Throws ClosureError where the two
/// are neighbours. Cost: at most four calls of align().
FoundClosure find_closure(
    const map_file::StoredMap& map, const PartGraph& graph, std::size_t from, std::size_t to,
    const map_merge::AlignmentParameters& parameters = {},
    const std::function<void(double)>& progress = [](double /*part*/) {});

}  // namespace understory::map_closure
