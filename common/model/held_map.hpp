// A listener's copy of a mapper's map.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::model {

/// Applies `delta` to `landmarks` (in order of id before and after). O(changed * log(map)), and
/// O(map) for each insertion or removal before the end.
std::vector<MapLandmark> with_delta(std::vector<MapLandmark> landmarks, const MapDelta& delta);

/// The map from MAP, MAP_DELTA and SLAM_UPDATE in their order of publication. MAP is rare:
/// landmarks follow every MAP_DELTA, and keyframes since the last MAP have the pose of their
/// SLAM_UPDATE. A new map is available from its first MAP_DELTA on, without a MAP.
class HeldMap {
 public:
  /// Takes the whole map; a map cut to bounds is skipped.
  void take(const WholeMap& map);
  /// Takes a change. One with an older version is skipped; one with another base version than the
  /// stored one is applied and counted as missed.
  void take(const MapDelta& delta);
  /// Takes an accepted keyframe's pose; an update that starts a map ends the previous map.
  void take(const MapUpdate& update);

  /// Takes a submap handed over by the mapper: its content is no longer in MAP and MAP_DELTA unless
  /// the mapper takes it back.
  void take(const Submap& submap);
  /// Takes the poses of the submaps.
  void take(const MapCorrection& correction);

  /// The part in the mapper's memory and the submaps handed over; a landmark's covariance in a
  /// submap is relative to the submap. O(map).
  std::optional<WholeMap> whole() const;
  /// The part in the mapper's memory; none before the first MAP and before the start of a map.
  const std::optional<WholeMap>& map() const { return map_; }
  /// Whether a MAP was taken since the start of the map: then its keyframes equal the mapper's.
  bool has_whole() const { return has_whole_; }
  /// Number of missing changes since the last MAP: some landmarks may be outdated.
  std::uint64_t missed() const { return missed_; }

 private:
  /// A submap at its latest pose.
  struct Away {
    geometry::SE2 map_T_submap;
    std::vector<MapLandmark> landmarks;  ///< Frame submap.
    std::vector<KeyframePose> keyframes;
  };
  void start();
  void comes_back(LandmarkId id);

  std::optional<WholeMap> map_;
  bool has_whole_ = false;
  std::uint64_t missed_ = 0;
  std::map<SubmapId, Away> away_;
  std::map<LandmarkId, SubmapId> away_of_;  ///< The submap of each landmark in `away_`.
};

}  // namespace understory::model
