// Output of the mapper: the vehicle's pose and the map as a whole.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/model/map.hpp"

namespace understory::model {

/// Channel SLAM_POSE, for one observation.
struct SlamPose {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  /// Status of the keyframe's update; none for a scan between keyframes.
  std::optional<MapUpdateStatus> status;
  bool is_coasting = false;  ///< Between keyframes, from odometry alone: too few landmarks match.
  std::optional<std::uint64_t> keyframe_sequence;  ///< The keyframe that determined the pose.
  std::uint64_t submap_id = 0;                     ///< The active submap.
  geometry::SE2 submap_T_vehicle;
  /// Covariance of submap_T_vehicle; m, rad.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint64_t correction_version = 0;  ///< Version of the present MAP_CORRECTION.
  geometry::SE2 map_T_submap;            ///< From that correction.
  geometry::SE2 map_T_odom;
  std::uint64_t reset_counter = 0;  ///< Counts jumps of the pose.
  /// Latest jump: old_T_new of the vehicle; identity at a change of `map_id`.
  geometry::SE2 reset_delta;
  std::uint32_t map_id = 1;     ///< Map of the pose; each map has its own frame.
  bool is_provisional = false;  ///< Too few keyframes agree with the map so far: it may be dropped.
  bool is_new_map = false;      ///< kFirstMap beside another map.
  bool is_lost = false;         ///< kNotSure, and odometry has a gap.

  /// True where the pose is localised or tracked.
  bool is_localised() const {
    if (!status) return !is_coasting;
    return *status == MapUpdateStatus::kFirstMap || *status == MapUpdateStatus::kUpdated;
  }
  /// The vehicle's pose in the map.
  geometry::SE2 map_T_vehicle() const { return map_T_submap * submap_T_vehicle; }
};

/// Channel MAP: landmarks and keyframes of the active submap.
struct WholeMap {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint64_t version = 0;            ///< Counts changes of the map.
  bool complete = true;                 ///< False: cut to the bounds of the request.
  std::vector<MapLandmark> landmarks;   ///< In order of id.
  std::vector<KeyframePose> keyframes;  ///< In order of time.
};

/// Channel MAP_DELTA: the changes from `base_version` of the map to `version`.
struct MapDelta {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint64_t base_version = 0;
  std::uint64_t version = 0;
  std::vector<MapLandmark> added;
  std::vector<MapLandmark> moved;
  std::vector<LandmarkId> removed;
  std::vector<std::pair<LandmarkId, LandmarkId>> merged;  ///< old -> new.
};

}  // namespace understory::model
