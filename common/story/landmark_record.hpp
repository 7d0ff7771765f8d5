// The record of one landmark.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/map.hpp"
#include "common/story/ring.hpp"

namespace understory::story {

/// Number of a moment; see Moments.
using MomentNumber = std::uint32_t;

/// A keyframe that saw or missed an expected landmark: four bytes, because there are many.
struct Look {
  std::uint32_t moment : 31;
  std::uint32_t is_seen : 1;
};

/// One value of EXISTENCE.
struct ProbabilityPoint {
  MomentNumber moment = 0;
  float probability = 0.0F;
};

/// Events of a landmark other than looks.
enum class EventKind : std::uint8_t {
  kBorn,        ///< SLAM_UPDATE.added.
  kJoined,      ///< SLAM_UPDATE.added for an existing landmark: its map was merged into the present
                ///< one.
  kBornAgain,   ///< SLAM_UPDATE.added by a restarted mapper: the earlier record was another
                ///< landmark.
  kTold,        ///< First listed by MAP or MAP_DELTA, without an earlier birth.
  kMerged,      ///< Merged into `other`.
  kTookUp,      ///< `other` was merged into this one.
  kRemoved,     ///< Removed from the map.
  kReturned,    ///< In the map again.
  kUnused,      ///< EXISTENCE: judged as removed.
  kUsed,        ///< EXISTENCE: in use (again).
  kHandedOver,  ///< Handed over with the submap `other`.
  kCameBack,    ///< Taken back from the submap.
};

/// One such event.
struct LandmarkEvent {
  MomentNumber moment = 0;
  EventKind kind = EventKind::kBorn;
  std::uint64_t other = 0;  ///< A landmark or a submap; see EventKind.
};

/// Origin of a landmark's record.
enum class Origin : std::uint8_t {
  kNotTold,     ///< Its origin is unknown.
  kByKeyframe,  ///< A keyframe added it.
  kByMap,  ///< It was in a complete MAP: from a given map, or older than the received messages.
  kByMapChange,  ///< A MAP_DELTA added or moved it; no SLAM_UPDATE did.
};

/// Whether it is still a landmark.
enum class Fate : std::uint8_t { kThere, kRemoved, kMerged };

/// The keyframe that first saw a landmark.
struct Sight {
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;
  Eigen::Vector2d vehicle_m{0.0, 0.0};  ///< Frame map, at that time.
};

/// One landmark; about 450 bytes with the first block of each ring.
struct LandmarkRecord {
  model::LandmarkId id = 0;
  model::LandmarkId survivor = 0;     ///< The landmark into which it was merged.
  Sight first_seen;                   ///< Valid if `seen` > 0.
  model::Utime told_utime = 0;        ///< First MAP or MAP_DELTA with it.
  Eigen::Vector2d first_m{0.0, 0.0};  ///< First position, frame map; valid if `has_position`.
  Eigen::Vector2d now_m{0.0, 0.0};    ///< Latest position, frame map.
  float cxx_m2 = 0.0F;                ///< Covariance of `now_m`; all zero if unknown.
  float cxy_m2 = 0.0F;
  float cyy_m2 = 0.0F;
  float radius_m = 0.0F;  ///< 0 = unknown.
  float largest_move_m = 0.0F;
  MomentNumber largest_move = 0;
  MomentNumber birth = 0;  ///< Valid if `origin` is kByKeyframe.
  MomentNumber last_seen = 0;
  MomentNumber last_missed = 0;
  MomentNumber end = 0;                ///< Valid if `fate` is not kThere.
  std::uint32_t last_seen_placed = 0;  ///< Moment::placed of `last_seen`.
  std::uint32_t seen = 0;              ///< Number of keyframes that saw it.
  std::uint32_t missed = 0;            ///< Number of keyframes that missed it.
  std::uint32_t gaps = 0;  ///< Number of gaps: placed keyframes in between that did not see it.
  std::uint32_t longest_gap = 0;        ///< Keyframes in the longest gap.
  std::uint32_t moves = 0;              ///< Number of MAP_DELTA.moved.
  std::uint32_t observation_count = 0;  ///< As in the map.
  std::uint32_t in_whole = 0;           ///< Number of the last MAP that contains it.
  std::uint32_t submap_map = 0;         ///< Map of `submap`.
  std::uint64_t submap = 0;             ///< Submap with which it was handed over; 0 = none.
  float least_probability = 1.0F;
  std::uint32_t newer = 0;  ///< Index of the next more recently used record; see LandmarkRecords.
  std::uint32_t older = 0;
  Origin origin = Origin::kNotTold;
  Fate fate = Fate::kThere;
  bool has_position = false;
  bool is_corner = false;
  bool is_in_use = true;
  Ring<Look> looks;
  Ring<ProbabilityPoint> probabilities;
  Ring<LandmarkEvent> events;
};

}  // namespace understory::story
