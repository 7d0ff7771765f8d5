// The place of a few landmarks among a few others, from pairs of them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Where points of one pass lie upon those of another one.
struct FoundPlace {
  geometry::SE2WithCovariance map_T_newest;  ///< With what is expected of it.
  std::vector<geometry::PointPair> pairs;    ///< `reference`: of theirs, `observed`: of ours.
};

/// Every pair of `ours` is laid upon every pair of `theirs` that is as far apart, and what else
/// lies upon each other there counts: the place with the largest odds (see log_odds_of_place()),
/// where no other place comes near to it. For scenes that are too poor for gates and
/// constellations: sees all places, so cost is O(n^2 m^2) distances, and O(n m) for each that fits
/// and is expected. `ours`: in the frame of the newest node, `theirs`: in the map, with variances;
/// `variance_m2`: added to the distance of each pair. `clutter_per_m2`: around each of theirs.
std::optional<FoundPlace> search_pairs(std::span<const geometry::UncertainPoint> ours,
                                       std::span<const geometry::UncertainPoint> theirs,
                                       double variance_m2, std::span<const double> clutter_per_m2,
                                       const geometry::SE2WithCovariance& expected);

}  // namespace understory::geoslam_mapper::smoothing
