// What a listener has of a mapper's map.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::model {

/// `landmarks` (in order of id) as a holder has them after `delta`: in order of id again.
/// O(changed * log(map)), and O(map) for each that is put in or taken out before the end.
std::vector<MapLandmark> with_delta(std::vector<MapLandmark> landmarks, const MapDelta& delta);

/// The map by MAP, MAP_DELTA and SLAM_UPDATE, in the order in which they were published. MAP comes
/// rarely: landmarks follow every MAP_DELTA, keyframes of the time since MAP have the pose of their
/// SLAM_UPDATE. A map that starts is held from its first MAP_DELTA on, without any MAP.
class HeldMap {
 public:
  /// Takes the whole map; one that is cut to bounds is passed over.
  void take(const WholeMap& map);
  /// Takes what changed. One with an older version is passed over; one that builds on a version
  /// that is not held is counted as missed, and taken.
  void take(const MapDelta& delta);
  /// Takes an accepted keyframe's pose; the update that starts a map ends the one before.
  void take(const MapUpdate& update);

  /// Takes what the mapper handed over: it is in MAP and MAP_DELTA no more, unless it comes back.
  void take(const Submap& submap);
  /// Takes where the submaps are.
  void take(const MapCorrection& correction);

  /// What the mapper holds of the map and what it handed over; a landmark's covariance in a submap
  /// is relative to that. O(map).
  std::optional<WholeMap> whole() const;
  /// What the mapper holds itself; none before the first whole one, or before a map has started.
  const std::optional<WholeMap>& map() const { return map_; }
  /// Whether a MAP was taken since the map started: its keyframes are those of the mapper.
  bool has_whole() const { return has_whole_; }
  /// How often changes were missing since the last MAP: some landmarks may be old.
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
  std::map<LandmarkId, SubmapId> away_of_;  ///< Those in `away_`.
};

}  // namespace understory::model
