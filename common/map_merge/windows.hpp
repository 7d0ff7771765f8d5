// The search for an overlap without a prior: parts of one map, found in the other.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/map_merge/landmark_set.hpp"

namespace understory::map_merge {

/// A motion that a part of one map was found by.
struct Hypothesis {
  /// map_T_searched; the covariance is that of the part's own pairs, generously.
  geometry::SE2WithCovariance map_T_searched;
  double log10_false_alarm = 0.0;  ///< Of the part alone.
  std::size_t inliers = 0;
};

/// The motions that windows gave, and how many were tried for them.
struct WindowSearch {
  std::vector<Hypothesis> hypotheses;  ///< Different ones, the most certain first.
  std::size_t windows = 0;
  std::size_t tried = 0;
};

/// How windows are made.
struct WindowSize {
  std::size_t landmarks = 0;
  /// Landmarks near to each other are known to each other at least so well [m], per axis: what they
  /// state beyond it is the error of a whole region.
  double most_sigma_m = 0.0;
};

/// Covers `searched` with windows of so many neighbouring landmarks, each half over the next ones,
/// and looks for each in `map`. Motions that no window alone is sure of are kept, too: whoever asks
/// verifies them on all landmarks. `progress` is called after each window with the part of
/// `searched` that is covered; what it throws ends the search.
WindowSearch search_windows(const constellation::ConstellationMap& map, const LandmarkSet& searched,
                            const WindowSize& size, const std::function<void(double)>& progress);

}  // namespace understory::map_merge
