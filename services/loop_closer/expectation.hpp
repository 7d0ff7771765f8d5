// What the mapper's poses allow: where the places are to the vehicle, and how many poses chance has
// there.
#pragma once

#include <span>

#include "services/loop_closer/place_memory.hpp"

namespace understory::loop_closer {

/// How a place lies to another one by the mapper's poses. Both count as independent: a map that
/// hangs together, or was corrected since the first was told, knows more than that.
geometry::SE2WithCovariance expected(const Place& from, const Place& to);

/// Squared Mahalanobis distance (3 degrees of freedom) of what was found from what is expected.
double squared_distance(const geometry::SE2WithCovariance& expected,
                        const geometry::SE2WithCovariance& found);

/// Number of poses, told apart, that the expectation allows around all of these places within
/// `gate_sigmas` and `reach_m`. O(places).
double allowed_poses(std::span<const Place> places, const Place& query, double gate_sigmas,
                     double reach_m);

}  // namespace understory::loop_closer
