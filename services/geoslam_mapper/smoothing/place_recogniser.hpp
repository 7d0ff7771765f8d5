// Where is a keyframe in the map? By prediction and gating, or by search of the whole map.
#pragma once

#include <optional>
#include <string>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"
#include "services/geoslam_mapper/smoothing/relative_variance.hpp"

namespace understory::geoslam_mapper::smoothing {

/// What a search of the whole map gave.
struct SearchResult {
  std::optional<Placement> placement;  ///< None where the search is not sure.
  std::uint32_t hypotheses = 0;        ///< Poses that were tried.
  double log10_false_alarm = 0.0;      ///< Bound on the chance of so good a pose anywhere.
  std::string reason;                  ///< Why there is no placement.
};

/// What tracking gave: a place by the prediction and what matches it.
struct Tracking {
  Placement placement;
  /// Enough of the landmarks match that could: at least `min_matched_ratio` of them, and without
  /// odometry at least `min_matched`.
  bool is_confirmed = false;
};

/// Places keyframes in a map that it does not change. It has no state.
class PlaceRecogniser {
 public:
  /// `parameters` gives the gates and how many matches are enough.
  explicit PlaceRecogniser(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Association in gates around a prediction, with landmarks whose gates tell them apart.
  Tracking track(const model::Keyframe& keyframe, const Prediction& prediction,
                 const GlobalMap& map) const;

  /// Search of the whole map without any prior (constellation::ConstellationMap). Landmarks count
  /// whose gates tell them apart from where the vehicle was found, not from where it comes from.
  /// The index must be up to date: LandmarkMap::catch_up().
  SearchResult search(const model::Keyframe& keyframe, const GlobalMap& map) const;

 private:
  Placement associate(const model::Keyframe& keyframe, const geometry::SE2WithCovariance& guess,
                      const std::optional<Reference>& relative_to,
                      const std::optional<Prediction>& tracked, const GlobalMap& map) const;

  SmoothingMapperParameters parameters_;
};

}  // namespace understory::geoslam_mapper::smoothing
