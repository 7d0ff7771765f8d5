// Landmarks and keyframes of maps, common to several types.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

#include "common/wire/convert.hpp"
#include "common/wire/convert_ids.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {

/// One landmark.
inline model::MapLandmark landmark(const map_landmark_t& wire, Checks& checks) {
  check_landmark(wire, checks);
  checks.range("times_seen", wire.times_seen, 0, std::numeric_limits<std::int32_t>::max());
  model::MapLandmark result;
  result.id = landmark_id(wire.id, checks);
  result.position_m = Eigen::Map<const Eigen::Vector2d>(wire.position_m);
  result.covariance_m2 = checks.covariance("covariance_m2", wire.covariance_m2);
  result.radius_m = wire.radius_m;
  result.observation_count = static_cast<std::uint32_t>(wire.times_seen);
  result.kind = static_cast<model::LandmarkKind>(wire.kind);
  return result;
}

/// The opposite of landmark().
inline map_landmark_t to_wire(const model::MapLandmark& landmark) {
  map_landmark_t wire{};
  wire.id = static_cast<std::int64_t>(landmark.id);
  copy_vector(landmark.position_m, wire.position_m);
  copy_matrix(landmark.covariance_m2, wire.covariance_m2);
  wire.radius_m = landmark.radius_m;
  wire.times_seen = static_cast<std::int32_t>(landmark.observation_count);
  wire.kind = static_cast<std::int8_t>(landmark.kind);
  return wire;
}

/// A list of landmarks.
inline std::vector<model::MapLandmark> landmarks(std::string_view field,
                                                 const std::vector<map_landmark_t>& wire,
                                                 Checks& checks) {
  std::vector<model::MapLandmark> result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    checks.in(field, i);
    result.push_back(landmark(wire[i], checks));
  }
  return result;
}

/// The opposite of landmarks().
inline std::vector<map_landmark_t> to_wire(const std::vector<model::MapLandmark>& landmarks) {
  std::vector<map_landmark_t> wire;
  wire.reserve(landmarks.size());
  for (const model::MapLandmark& landmark : landmarks) wire.push_back(to_wire(landmark));
  return wire;
}

/// Poses of keyframes.
inline std::vector<model::KeyframePose> keyframe_poses(const std::vector<keyframe_pose_t>& wire,
                                                       Checks& checks) {
  std::vector<model::KeyframePose> result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    const keyframe_pose_t& one = wire[i];
    checks.in("keyframes", i);
    checks.range("keyframe_seq", static_cast<double>(one.keyframe_seq), 0.0, 9.3e18);
    checks.pose("map_T_vehicle", one.map_T_vehicle);
    result.push_back({static_cast<std::uint64_t>(one.keyframe_seq), one.utime,
                      from_wire(one.map_T_vehicle),
                      checks.covariance("covariance", one.covariance)});
  }
  return result;
}

/// The opposite of keyframe_poses().
inline std::vector<keyframe_pose_t> to_wire(const std::vector<model::KeyframePose>& poses) {
  std::vector<keyframe_pose_t> wire;
  wire.reserve(poses.size());
  for (const model::KeyframePose& pose : poses) {
    keyframe_pose_t& out = wire.emplace_back();
    out.utime = pose.utime;
    out.keyframe_seq = static_cast<std::int64_t>(pose.keyframe_sequence);
    out.map_T_vehicle = to_wire(pose.map_T_vehicle);
    copy_matrix(pose.covariance, out.covariance);
  }
  return wire;
}

}  // namespace understory::wire
