// Submaps, which the mapper hands over, and closures between them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Number of a submap within its map, from 1; never reused. 0 = none.
using SubmapId = std::uint64_t;

/// Channels SUBMAP and SUBMAP_REPLY: part of a map, in a frame of its own.
struct Submap {
  Utime utime = 0;  ///< Stamp of the map's newest keyframe at the handover.
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  SubmapId id = 0;
  std::uint64_t content_hash = 0;  ///< fnv1a() of the payload.
  geometry::SE2 map_T_submap;      ///< Pose at the handover.
  /// In order of id; positions in the frame `submap`, covariances relative to it.
  std::vector<MapLandmark> landmarks;
  /// In order of time; `map_T_vehicle` is submap_T_vehicle here.
  std::vector<KeyframePose> keyframes;
  std::vector<SubmapId> replaced;  ///< Earlier submaps whose content is in this one or was removed.
  std::string payload;             ///< The mapper's data to take it back.
};

/// FNV-1a, 64 bit (Fowler, Noll, Vo), of bytes.
constexpr std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 0x100000001b3ULL;
  }
  return hash;
}

/// Channel SUBMAP_STORED.
struct SubmapStored {
  Utime utime = 0;  ///< Stamp of the SUBMAP.
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  SubmapId id = 0;
  std::uint64_t content_hash = 0;
};

/// Channel SUBMAP_QUERY.
struct SubmapQuery {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::vector<SubmapId> ids;
};

/// Pose of a submap.
struct SubmapPose {
  SubmapId id = 0;
  geometry::SE2 map_T_submap;
};

/// Channel MAP_CORRECTION: poses of all submaps that were handed over.
struct MapCorrection {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::uint64_t version = 0;        ///< From 1.
  std::vector<SubmapPose> submaps;  ///< In order of id.
};

/// One end of a loop closure.
struct LoopEnd {
  SubmapId submap = 0;         ///< 0: the keyframe is used.
  std::uint64_t keyframe = 0;  ///< Sequence of the keyframe.
};

/// Channel LOOP_CLOSURE.
struct LoopClosure {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::uint64_t id = 0;  ///< From 1; unique in a map.
  std::string source;
  bool is_revoked = false;
  LoopEnd from;
  LoopEnd to;
  geometry::SE2WithCovariance from_T_to;
  double log10_false_alarm = 0.0;  ///< 0 where not known.
};

/// Channel LOOP_RESULT.
struct LoopResult {
  /// Result of a closure.
  enum class Status : std::uint8_t { kAccepted = 0, kWaiting = 1, kRefused = 2, kRevoked = 3 };
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint32_t map_id = 1;
  std::uint64_t closure_id = 0;
  Status status = Status::kRefused;
  std::string reason;  ///< Reason of a refusal; for an accepted closure its correction.
};

}  // namespace understory::model
