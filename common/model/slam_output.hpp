// What the mapper publishes about the vehicle and about the map as a whole.
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
  /// What the keyframe's update says; none = tracked between keyframes.
  std::optional<MapUpdateStatus> status;
  std::optional<std::uint64_t> keyframe_sequence;  ///< The keyframe that decided the pose.
  std::uint64_t submap_id = 0;
  geometry::SE2 submap_T_vehicle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of submap_T_vehicle.
  std::uint64_t correction_version = 0;
  geometry::SE2 map_T_submap;
  geometry::SE2 map_T_odom;
  std::uint64_t reset_counter = 0;
  geometry::SE2 reset_delta;  ///< Latest jump: old_T_new of the vehicle.

  /// The pose means something.
  bool is_localised() const {
    return !status || *status == MapUpdateStatus::kFirstMap || *status == MapUpdateStatus::kUpdated;
  }
  geometry::SE2 map_T_vehicle() const { return map_T_submap * submap_T_vehicle; }
};

/// Channel MAP.
struct WholeMap {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::uint64_t version = 0;            ///< Counts changes of the map.
  bool complete = true;                 ///< False: cut to the bounds that were asked for.
  std::vector<MapLandmark> landmarks;   ///< In order of id.
  std::vector<KeyframePose> keyframes;  ///< In order of time.
};

/// Channel MAP_DELTA: what leads from `base_version` of the map to `version`.
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
