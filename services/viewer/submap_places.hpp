// What the mapper handed over: it is in MAP and MAP_DELTA no more, but still part of the map.
#pragma once

#include <unordered_map>
#include <vector>

#include "common/model/submap.hpp"

namespace understory::viewer {

/// A submap that was handed over, at its latest pose.
struct SubmapPlace {
  geometry::SE2 map_T_submap;
  std::vector<model::MapLandmark> landmarks;  ///< Frame submap.
  std::vector<Eigen::Vector2d> outline_m;     ///< Convex hull of them, frame submap.
};

/// Which landmarks are in which submap.
class SubmapPlaces {
 public:
  /// Takes a submap; gives back its landmarks in the frame map. One that is repeated gives none.
  std::vector<model::MapLandmark> take(const model::Submap& submap);
  /// Takes where the submaps are; gives back the landmarks of those that moved.
  std::vector<model::MapLandmark> take(const model::MapCorrection& correction);
  /// The mapper holds it itself again, or it is gone.
  void comes_back(model::LandmarkId id);
  /// Whether a landmark is in a submap.
  bool holds(model::LandmarkId id) const { return submap_of_.contains(id); }
  /// Nothing is handed over.
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
