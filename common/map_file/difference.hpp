// Differences between two maps of one frame.
#pragma once

#include <optional>
#include <vector>

#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// A landmark of both maps, at different positions.
struct MovedLandmark {
  model::LandmarkId id = 0;
  double distance_m = 0.0;
  /// Squared distance in units of the sum of both covariances, two degrees of freedom; infinite
  /// where that sum is singular.
  double chi2 = 0.0;
};

/// A landmark of both maps whose state of use or probability differs. Without a state of existence
/// it is in use.
struct ExistenceChange {
  model::LandmarkId id = 0;
  bool was_in_use = true;
  bool is_in_use = true;
  std::optional<double>
      probability_before;  ///< Probability of existence; none if the map has none.
  std::optional<double> probability_after;
};

/// Changes from one map to another.
struct MapDifference {
  std::vector<model::LandmarkId> added;
  std::vector<model::LandmarkId> removed;
  std::vector<MovedLandmark> moved;        ///< Landmarks beyond the quantile, in order of id.
  std::size_t kept = 0;                    ///< In both, within the quantile.
  std::vector<ExistenceChange> existence;  ///< In order of id.
};

/// Limits for a move and a change of existence.
struct DifferenceLimits {
  double quantile = 0.99;  ///< Quantile of chi-squared, 0 to 1; a landmark beyond it has moved.
  /// Standard deviation in x and in y of a landmark without covariance [m]; 0: any move counts.
  double unknown_sigma_m = 0.0;
  /// Changes of the probability of existence above this are listed, if both maps have one.
  double probability_change = 0.1;
};

/// The value that a chi-squared variable with two degrees of freedom exceeds with probability 1 -
/// `quantile`, between 0 and 1.
double chi2_of_quantile(double quantile);

/// The changes from `before` to `after`. Landmarks are matched by id. Both maps must have one
/// frame; they are not aligned. The errors of both estimates are assumed independent; for two
/// states of one map they are not, and moves are then underestimated. O(size).
MapDifference difference(const StoredMap& before, const StoredMap& after,
                         const DifferenceLimits& limits);

}  // namespace understory::map_file
