// How two parts of a map lie to each other, found from their landmarks.
#pragma once

#include <functional>

#include "common/map_closure/closing.hpp"
#include "common/map_merge/alignment.hpp"

namespace understory::map_closure {

/// What was found. But for `alignment.outcome` it is of the best motion, also where that is not
/// proven.
struct FoundClosure {
  map_merge::Alignment alignment;
  geometry::SE2WithCovariance from_T_to;  ///< With what a place's own error adds.
  double reach_m = 0.0;                   ///< Path to both sides whose landmarks it took.
};

/// Looks for the landmarks of the one part among those of the other (map_merge::align), with no
/// prior, first of the two alone, then with those up to 30, 60 and 120 m further on the path,
/// never of ground that is nearer to the other part than half the way. What is accepted chance
/// gives less often than once in 10^9, in all of it. The place of each has an error of its own
/// beside what the landmarks leave (5 cm, 3 mrad; docs/decisions/093). Throws ClosureError where
/// the two are neighbours. Cost: of align(), four times at most.
FoundClosure find_closure(
    const map_file::StoredMap& map, const PartGraph& graph, std::size_t from, std::size_t to,
    const map_merge::AlignmentParameters& parameters = {},
    const std::function<void(double)>& progress = [](double /*part*/) {});

}  // namespace understory::map_closure
