// The history of every landmark, from the messages on the map.
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
/// O(landmarks in it).
class LandmarkBook {
 public:
  /// Pose of a submap at its handover, and now.
  struct SubmapPlace {
    geometry::SE2 then_map_T_submap;
    geometry::SE2 now_map_T_submap;
  };

  /// Stores at most `limits.landmarks` landmarks in at most `bytes`.
  LandmarkBook(const Limits& limits, std::size_t bytes);

  /// Takes a keyframe's update; one without a pose has no information on landmarks.
  void take(const model::MapUpdate& update);
  void take(const model::MapDelta& delta);            ///< Takes a change of the map.
  void take(const model::WholeMap& map);              ///< Takes the map, also a cut one.
  void take(const model::Existence& existence);       ///< Takes probabilities.
  void take(const model::Submap& submap);             ///< Takes a submap handed over.
  void take(const model::MapCorrection& correction);  ///< Takes the poses of the submaps.

  /// The record of a landmark, or null. O(1).
  const LandmarkRecord* find(model::LandmarkId id) const { return records_.find(id); }
  /// The moment of this number; null if it was dropped.
  const Moment* moment(MomentNumber number) const { return moments_.find(number); }
  /// Its present position, frame map, after moves of submaps. Precondition: `has_position`.
  Eigen::Vector2d position_m(const LandmarkRecord& record) const;
  /// Whether the latest complete MAP of its map unexpectedly does not contain it.
  bool is_left_out(const LandmarkRecord& record) const;

  /// The map of the last placed keyframe; 0 before the first one.
  std::uint32_t map_in_use() const { return map_in_use_; }
  const LandmarkRecords& records() const { return records_; }  ///< All records.
  /// Memory held [bytes], without the submaps.
  std::size_t bytes() const { return records_.bytes() + moments_.bytes(); }
  static std::size_t fixed_bytes(const Limits& limits);  ///< Largest memory of moments and submaps.

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
  std::uint32_t wholes_ = 0;                             ///< Number of complete MAP messages.
  std::map<std::uint32_t, std::uint32_t> latest_whole_;  ///< Number of the last MAP of each map.
  std::map<std::pair<std::uint32_t, model::SubmapId>, SubmapPlace> submaps_;
};

}  // namespace understory::story
