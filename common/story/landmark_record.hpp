// What is remembered of one landmark.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/map.hpp"
#include "common/story/ring.hpp"

namespace understory::story {

/// Number of a moment; see Moments.
using MomentNumber = std::uint32_t;

/// A keyframe that should have seen a landmark: four bytes, since there are many.
struct Look {
  std::uint32_t moment : 31;
  std::uint32_t is_seen : 1;
};

/// One value of EXISTENCE.
struct ProbabilityPoint {
  MomentNumber moment = 0;
  float probability = 0.0F;
};

/// What happens to a landmark beside being seen.
enum class EventKind : std::uint8_t {
  kBorn,        ///< SLAM_UPDATE.added.
  kJoined,      ///< Likewise, of a landmark that was there: its map became part of the one in use.
  kBornAgain,   ///< Likewise, by a mapper that began anew: what was known was of another one.
  kTold,        ///< By MAP or MAP_DELTA for the first time, without a birth before.
  kMerged,      ///< Into `other`.
  kTookUp,      ///< `other` is this one.
  kRemoved,     ///< From the map.
  kReturned,    ///< In the map again.
  kUnused,      ///< EXISTENCE: taken for gone.
  kUsed,        ///< EXISTENCE: in use (again).
  kHandedOver,  ///< With the submap `other`.
  kCameBack,    ///< From the submap.
};

/// One such event.
struct LandmarkEvent {
  MomentNumber moment = 0;
  EventKind kind = EventKind::kBorn;
  std::uint64_t other = 0;  ///< A landmark or a submap; see EventKind.
};

/// How a landmark came to be known.
enum class Origin : std::uint8_t {
  kNotTold,      ///< It was named, but nothing said where it comes from.
  kByKeyframe,   ///< A keyframe added it.
  kByMap,        ///< It was in a whole MAP: given, or older than what was heard.
  kByMapChange,  ///< A MAP_DELTA added or moved it; no SLAM_UPDATE did.
};

/// Whether it still is a landmark.
enum class Fate : std::uint8_t { kThere, kRemoved, kMerged };

/// The keyframe by which a landmark was first seen.
struct Sight {
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;
  Eigen::Vector2d vehicle_m{0.0, 0.0};  ///< Frame map, as it was then.
};

/// One landmark; about 450 bytes with the first block of each ring.
struct LandmarkRecord {
  model::LandmarkId id = 0;
  model::LandmarkId survivor = 0;     ///< Where it was merged.
  Sight first_seen;                   ///< Where `seen` > 0.
  model::Utime told_utime = 0;        ///< First MAP or MAP_DELTA with it.
  Eigen::Vector2d first_m{0.0, 0.0};  ///< As first told, frame map; where `has_position`.
  Eigen::Vector2d now_m{0.0, 0.0};    ///< As last told, frame map.
  float cxx_m2 = 0.0F;                ///< Of `now_m`; all zero where it was not told.
  float cxy_m2 = 0.0F;
  float cyy_m2 = 0.0F;
  float radius_m = 0.0F;  ///< 0 = unknown.
  float largest_move_m = 0.0F;
  MomentNumber largest_move = 0;
  MomentNumber birth = 0;  ///< Where `origin` is kByKeyframe.
  MomentNumber last_seen = 0;
  MomentNumber last_missed = 0;
  MomentNumber end = 0;                 ///< Where `fate` is not kThere.
  std::uint32_t last_seen_placed = 0;   ///< Moment::placed of `last_seen`.
  std::uint32_t seen = 0;               ///< Keyframes.
  std::uint32_t missed = 0;             ///< Keyframes.
  std::uint32_t gaps = 0;               ///< Times that placed keyframes did not see it in between.
  std::uint32_t longest_gap = 0;        ///< Keyframes in between.
  std::uint32_t moves = 0;              ///< MAP_DELTA.moved.
  std::uint32_t observation_count = 0;  ///< As the map states it.
  std::uint32_t in_whole = 0;           ///< Number of the last MAP that listed it.
  std::uint32_t submap_map = 0;         ///< Map of `submap`.
  std::uint64_t submap = 0;             ///< That it was handed over with; 0 = none.
  float least_probability = 1.0F;
  std::uint32_t newer = 0;  ///< Place of the one that was spoken of next; see LandmarkRecords.
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
