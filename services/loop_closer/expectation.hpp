// Relative poses of places predicted by the mapper, and the number of poses that they allow.
#pragma once

#include <span>

#include "services/loop_closer/place_memory.hpp"

namespace understory::loop_closer {

/// Relative pose of two places from the mapper's poses. Both are treated as independent: the mapper
/// knows more if its map connects them or was corrected since the first pose was published.
geometry::SE2WithCovariance expected(const Place& from, const Place& to);

/// Squared Mahalanobis distance (3 degrees of freedom) between the found and the expected pose.
double squared_distance(const geometry::SE2WithCovariance& expected,
                        const geometry::SE2WithCovariance& found);

/// Number of distinguishable poses around all of these places within the expectation's
/// `gate_sigmas` and `reach_m`. O(places).
double allowed_poses(std::span<const Place> places, const Place& query, double gate_sigmas,
                     double reach_m);

}  // namespace understory::loop_closer
