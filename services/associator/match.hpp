// Pairs the observations of one scan with tracks, at a known pose.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "services/associator/track_list.hpp"

namespace understory::associator {

/// A track with fewer observations is young: it may be an outlier of its neighbour.
inline constexpr std::uint32_t kYoung = 4;
/// A young track is paired last: it takes a detection only if that is e^4 times likelier than for
/// an older one [squared Mahalanobis distance].
inline constexpr double kReluctance = 8.0;

/// One-to-one pairs inside the gate at the pose `local_T_vehicle`: likeliest first, then improved
/// by swaps. A trunk and a corner never pair. A pair is ambiguous if another pairing is less than
/// `min_likelihood_ratio` times less likely. In order of observation. Cost O(candidates log
/// candidates); few candidates per observation in any forest.
std::vector<Match> match(std::span<const Track> tracks, std::span<const Observation> observations,
                         const geometry::SE2WithCovariance& local_T_vehicle,
                         const AssociatorParameters& parameters);

}  // namespace understory::associator
