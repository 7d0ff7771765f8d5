// The search for an overlap without a prior: finds parts of one map in the other.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/map_merge/landmark_set.hpp"

namespace understory::map_merge {

/// A motion at which a part of one map was found.
struct Hypothesis {
  /// map_T_searched; the covariance is that of the part's own pairs, enlarged.
  geometry::SE2WithCovariance map_T_searched;
  double log10_false_alarm = 0.0;  ///< Bound for the part alone.
  std::size_t inliers = 0;
};

/// The motions from windows, and the number of tried ones.
struct WindowSearch {
  std::vector<Hypothesis> hypotheses;  ///< Different ones, the most certain first.
  std::size_t windows = 0;
  std::size_t tried = 0;
};

/// Size of windows.
struct WindowSize {
  std::size_t landmarks = 0;
  /// Upper limit of the relative sigma of near landmarks [m], per axis: a larger stated sigma is a
  /// common error of the region.
  double most_sigma_m = 0.0;
};

/// Covers `searched` with overlapping windows of neighbouring landmarks and searches each in `map`.
/// Motions that are not certain by one window alone are kept too: the caller verifies them on all
/// landmarks. `progress` is called after each window with the covered fraction of `searched`; an
/// exception of it ends the search.
WindowSearch search_windows(const constellation::ConstellationMap& map, const LandmarkSet& searched,
                            const WindowSize& size, const std::function<void(double)>& progress);

}  // namespace understory::map_merge
