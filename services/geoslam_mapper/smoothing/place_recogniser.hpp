// Localises a keyframe in the map: by prediction and gating, or by search of the whole map.
#pragma once

#include <optional>
#include <string>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"
#include "services/geoslam_mapper/smoothing/relative_variance.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Result of a search of the whole map.
struct SearchResult {
  std::optional<Placement> placement;  ///< None if the result is ambiguous.
  std::uint32_t hypotheses = 0;        ///< Number of poses tested.
  double log10_false_alarm = 0.0;      ///< Bound on the chance of an equally good pose anywhere.
  std::string reason;                  ///< Why there is no placement.
};

/// Result of tracking: a placement from the prediction and its matches.
struct Tracking {
  Placement placement;
  /// Enough of the possible matches were found: at least `min_matched_ratio` of them, and without
  /// odometry at least `min_matched`.
  bool is_confirmed = false;
};

/// Localises keyframes in a map without changing it. It has no state.
class PlaceRecogniser {
 public:
  /// `parameters` gives the gates and the least number of matches.
  explicit PlaceRecogniser(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Association in gates around a prediction, using landmarks whose gates do not overlap.
  Tracking track(const model::Keyframe& keyframe, const Prediction& prediction,
                 const GlobalMap& map) const;

  /// Search of the whole map without any prior (constellation::ConstellationMap). Whether gates
  /// overlap is judged at the pose found, not at the predicted pose. The index must be up to date:
  /// LandmarkMap::catch_up().
  SearchResult search(const model::Keyframe& keyframe, const GlobalMap& map) const;

 private:
  Placement associate(const model::Keyframe& keyframe, const geometry::SE2WithCovariance& guess,
                      const std::optional<Reference>& relative_to,
                      const std::optional<Prediction>& tracked, const GlobalMap& map) const;

  SmoothingMapperParameters parameters_;
};

}  // namespace understory::geoslam_mapper::smoothing
