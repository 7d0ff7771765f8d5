// What two maps of one frame have not in common.
#pragma once

#include <optional>
#include <vector>

#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// A landmark that both maps have, at different places.
struct MovedLandmark {
  model::LandmarkId id = 0;
  double distance_m = 0.0;
  /// Squared distance in units of the sum of both covariances, two degrees of freedom; infinite
  /// where that sum is singular.
  double chi2 = 0.0;
};

/// A landmark that both maps have, which left use or came back to it, or of which another
/// probability is known. Without a state of existence it is in use.
struct ExistenceChange {
  model::LandmarkId id = 0;
  bool was_in_use = true;
  bool is_in_use = true;
  std::optional<double> probability_before;  ///< That it exists; none where the map does not say.
  std::optional<double> probability_after;
};

/// From one map to another.
struct MapDifference {
  std::vector<model::LandmarkId> added;
  std::vector<model::LandmarkId> removed;
  std::vector<MovedLandmark> moved;        ///< Those beyond the quantile, in order of id.
  std::size_t kept = 0;                    ///< In both, within the quantile.
  std::vector<ExistenceChange> existence;  ///< In order of id.
};

/// When a landmark has moved, and when its existence has changed.
struct DifferenceLimits {
  double quantile = 0.99;  ///< Of chi-squared; what lies beyond it has moved. Within 0 and 1.
  /// Standard deviation in x and in y of a landmark without covariance [m]; 0: any move counts.
  double unknown_sigma_m = 0.0;
  /// Of the probability that a landmark exists, where both maps know it: a larger one is told.
  double probability_change = 0.1;
};

/// The value that a chi-squared variable with two degrees of freedom exceeds with probability
/// 1 - `quantile`, which lies within 0 and 1.
double chi2_of_quantile(double quantile);

/// What changes from `before` to `after`. A landmark is the same one where it has the same id. The
/// frames are taken to be the same: nothing is aligned. The errors of both estimates are taken to
/// be independent; of two states of one map they are not, and moves are then understated. O(size).
MapDifference difference(const StoredMap& before, const StoredMap& after,
                         const DifferenceLimits& limits);

}  // namespace understory::map_file
