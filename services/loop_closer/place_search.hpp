// Where among the places of the drive a new one lies.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/stem_recogniser.hpp"
#include "services/loop_closer/parameters.hpp"
#include "services/loop_closer/place_memory.hpp"

namespace understory::loop_closer {

/// A place that may be where the query is.
struct FoundPlace {
  std::uint64_t keyframe = 0;  ///< Of the place.
  geometry::SE2WithCovariance place_T_query;
  double log_ratio = 0.0;  ///< Natural logarithm of the likelihood over that of chance.
  std::size_t pairs = 0;   ///< Stems of the query that the place has.
};

/// What a search gives.
struct SearchAnswer {
  std::vector<FoundPlace> found;  ///< The one that answers first.
  /// Decades between the likeliest and the likeliest of those that put the query elsewhere.
  double margin_decades = 0.0;
};

/// Detector and verifier in one. The places are its only state, so it is made again from them.
class PlaceSearch {
 public:
  /// Without places.
  explicit PlaceSearch(const StemParameters& parameters);

  /// Adds a place. Precondition: its keyframe is later than those before.
  void add(const Place& place);
  /// Looks among the places of keyframes up to `newest`. The same places give the same answer.
  SearchAnswer find(std::span<const LevelStem> stems, std::uint64_t newest) const;
  /// Most poses that chance has around one place, of those that can be told apart.
  double poses_per_place() const;
  /// Distance of two places that are found [m].
  double reach_m() const { return parameters_.max_distance_m; }

 private:
  place_recognition::StemRecogniserParameters parameters_;
  place_recognition::StemRecogniser recogniser_;
};

/// Poses that are told apart [m], [rad]: by these chance has so many.
inline constexpr double kPoseCellM = 0.1;
inline constexpr double kPoseCellRad = 0.01;

}  // namespace understory::loop_closer
