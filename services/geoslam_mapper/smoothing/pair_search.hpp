// Search for the pose of a few landmarks among a few others, by pairs.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The pose at which points of one pass coincide with those of another one.
struct FoundPlace {
  geometry::SE2WithCovariance map_T_newest;  ///< Fused with the expected pose.
  std::vector<geometry::PointPair>
      pairs;  ///< `reference`: index in `theirs`, `observed`: index in `ours`.
};

/// Aligns every pair of `ours` with every pair of `theirs` of equal distance, and counts all points
/// that then coincide. Returns the pose with the largest odds (see log_odds_of_place()), if no
/// other pose is nearly as likely. For scenes with too few landmarks for gates and constellations:
/// it tests all poses, so the cost is O(n^2 m^2) distances, and O(n m) for each alignment that fits
/// and is expected. `ours`: in the frame of the newest node, `theirs`: in the map, with variances;
/// `variance_m2`: added to the distance of each pair. `clutter_per_m2`: around each of theirs.
std::optional<FoundPlace> search_pairs(std::span<const geometry::UncertainPoint> ours,
                                       std::span<const geometry::UncertainPoint> theirs,
                                       double variance_m2, std::span<const double> clutter_per_m2,
                                       const geometry::SE2WithCovariance& expected);

}  // namespace understory::geoslam_mapper::smoothing
