// Submaps that the mapper handed over: they are no longer in MAP and MAP_DELTA, but still part of
// the map.
#pragma once

#include <unordered_map>
#include <vector>

#include "common/model/submap.hpp"

namespace understory::viewer {

/// A submap that was handed over, with its latest pose.
struct SubmapPlace {
  geometry::SE2 map_T_submap;
  std::vector<model::MapLandmark> landmarks;  ///< Frame submap.
  std::vector<Eigen::Vector2d> outline_m;     ///< Their convex hull, frame submap.
};

/// Maps landmarks to submaps.
class SubmapPlaces {
 public:
  /// Adds a submap; returns its landmarks in the frame map. A repeated one returns none.
  std::vector<model::MapLandmark> take(const model::Submap& submap);
  /// Updates the submaps' poses; returns the landmarks of those that moved.
  std::vector<model::MapLandmark> take(const model::MapCorrection& correction);
  /// The mapper has the landmark again, or it was removed.
  void comes_back(model::LandmarkId id);
  /// Whether a landmark is in a submap.
  bool holds(model::LandmarkId id) const { return submap_of_.contains(id); }
  /// Removes all submaps.
  void clear();
  /// By id.
  const std::unordered_map<model::SubmapId, SubmapPlace>& places() const { return places_; }

 private:
  std::unordered_map<model::SubmapId, SubmapPlace> places_;
  std::unordered_map<model::LandmarkId, model::SubmapId> submap_of_;
};

/// Convex hull, counter-clockwise, without points on its edges. O(n log n).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points_m);

}  // namespace understory::viewer
