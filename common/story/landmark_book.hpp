// What became of every landmark, from the messages about the map.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "common/story/landmark_records.hpp"
#include "common/story/limits.hpp"
#include "common/story/moments.hpp"

namespace understory::story {

/// Follows SLAM_UPDATE, MAP_DELTA, MAP, EXISTENCE, SUBMAP and MAP_CORRECTION. Each message costs
/// O(landmarks that it names).
class LandmarkBook {
 public:
  /// Where a submap was when it was handed over, and where it is.
  struct SubmapPlace {
    geometry::SE2 then_map_T_submap;
    geometry::SE2 now_map_T_submap;
  };

  /// Keeps `limits.landmarks` landmarks in `bytes`, or as many as go into that.
  LandmarkBook(const Limits& limits, std::size_t bytes);

  /// Takes what a keyframe did; one that was not placed says nothing of landmarks.
  void take(const model::MapUpdate& update);
  void take(const model::MapDelta& delta);            ///< Takes a change of the map.
  void take(const model::WholeMap& map);              ///< Takes the map; one that is cut as well.
  void take(const model::Existence& existence);       ///< Takes probabilities.
  void take(const model::Submap& submap);             ///< Takes what was handed over.
  void take(const model::MapCorrection& correction);  ///< Takes where the submaps are.

  /// The record of a landmark, or null. O(1).
  const LandmarkRecord* find(model::LandmarkId id) const { return records_.find(id); }
  /// The moment of this number; null where it had to go.
  const Moment* moment(MomentNumber number) const { return moments_.find(number); }
  /// Where it is now, frame map: submaps may have moved since. Precondition: `has_position`.
  Eigen::Vector2d position_m(const LandmarkRecord& record) const;
  /// Whether the latest whole MAP of its map should have listed it and did not.
  bool is_left_out(const LandmarkRecord& record) const;

  /// The map of the last placed keyframe; 0 before any.
  std::uint32_t map_in_use() const { return map_in_use_; }
  const LandmarkRecords& records() const { return records_; }  ///< All.
  /// Held, without the submaps.
  std::size_t bytes() const { return records_.bytes() + moments_.bytes(); }
  static std::size_t fixed_bytes(const Limits& limits);  ///< Of moments and submaps, at most.

 private:
  void born(model::LandmarkId id, bool with_its_map, model::Utime utime, MomentNumber moment);
  void seen(model::LandmarkId id, const Sight& sight, MomentNumber moment);
  void missed(model::LandmarkId id, MomentNumber moment);
  void merged(model::LandmarkId old_id, model::LandmarkId new_id, MomentNumber moment);
  void removed(model::LandmarkId id, MomentNumber moment);
  LandmarkRecord& told(const model::MapLandmark& landmark, Origin origin, MomentNumber moment);
  void place(LandmarkRecord& record, const model::MapLandmark& landmark, MomentNumber moment);
  void note(LandmarkRecord& record, LandmarkEvent event);

  Limits limits_;
  Moments moments_;
  LandmarkRecords records_;
  std::uint32_t map_in_use_ = 0;
  std::uint32_t wholes_ = 0;                             ///< MAP messages, complete ones.
  std::map<std::uint32_t, std::uint32_t> latest_whole_;  ///< Of a map, the number of its last MAP.
  std::map<std::pair<std::uint32_t, model::SubmapId>, SubmapPlace> submaps_;
};

}  // namespace understory::story
