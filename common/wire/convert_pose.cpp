#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

/// Common part of both versions, except the status.
template <class Wire>
model::SlamPose slam_pose(const Wire& wire, Checks& checks) {
  checks.pose("submap_T_vehicle", wire.submap_T_vehicle);
  checks.pose("map_T_submap", wire.map_T_submap);
  checks.pose("map_T_odom", wire.map_T_odom);
  checks.pose("reset_delta", wire.reset_delta);
  checks.range("submap_id", static_cast<double>(wire.submap_id), 0.0, 9.3e18);
  checks.range("correction_version", static_cast<double>(wire.correction_version), 0.0, 9.3e18);
  checks.range("reset_counter", static_cast<double>(wire.reset_counter), 0.0, 9.3e18);

  model::SlamPose pose;
  take_stamp(wire, pose);
  if (wire.keyframe_seq >= 0)
    pose.keyframe_sequence = static_cast<std::uint64_t>(wire.keyframe_seq);
  pose.submap_id = static_cast<std::uint64_t>(wire.submap_id);
  pose.submap_T_vehicle = from_wire(wire.submap_T_vehicle);
  pose.covariance = checks.covariance("covariance", wire.covariance);

  pose.correction_version = static_cast<std::uint64_t>(wire.correction_version);
  pose.map_T_submap = from_wire(wire.map_T_submap);
  pose.map_T_odom = from_wire(wire.map_T_odom);
  pose.reset_counter = static_cast<std::uint64_t>(wire.reset_counter);
  pose.reset_delta = from_wire(wire.reset_delta);
  return pose;
}

/// Copies the status.
void copy_status(std::int8_t status, model::SlamPose& pose) {
  pose.is_coasting = status == slam_pose2_t::COASTING;
  pose.is_lost = status == slam_pose2_t::LOST;
  pose.is_new_map = status == slam_pose2_t::NEW_MAP;
  if (pose.is_lost) {
    pose.status = model::MapUpdateStatus::kNotSure;
  } else if (pose.is_new_map) {
    pose.status = model::MapUpdateStatus::kFirstMap;
  } else if (status < slam_pose2_t::TRACKED) {
    pose.status = static_cast<model::MapUpdateStatus>(status);
  }
}

std::int8_t status_of(const model::SlamPose& pose) {
  if (!pose.status) return pose.is_coasting ? slam_pose2_t::COASTING : slam_pose2_t::TRACKED;
  if (*pose.status == model::MapUpdateStatus::kNotSure && pose.is_lost) return slam_pose2_t::LOST;
  if (*pose.status == model::MapUpdateStatus::kFirstMap && pose.is_new_map)
    return slam_pose2_t::NEW_MAP;
  return static_cast<std::int8_t>(*pose.status);
}

}  // namespace

Result<model::SlamPose> from_wire(const slam_pose2_t& wire) {
  Checks checks;
  checks.range("status", wire.status, slam_pose2_t::FIRST_MAP, slam_pose2_t::NEW_MAP);
  checks.range("map_id", wire.map_id, 1, kMostMaps);
  model::SlamPose pose = slam_pose(wire, checks);
  copy_status(wire.status, pose);
  pose.map_id = static_cast<std::uint32_t>(wire.map_id);
  pose.is_provisional = wire.provisional != 0;
  return checks.result(pose);
}

Result<model::SlamPose> from_wire(const slam_pose_t& wire) {
  Checks checks;
  checks.range("status", wire.status, slam_pose_t::FIRST_MAP, slam_pose_t::COASTING);
  model::SlamPose pose = slam_pose(wire, checks);
  copy_status(wire.status, pose);
  return checks.result(pose);
}

slam_pose2_t to_wire(const model::SlamPose& pose) {
  slam_pose2_t wire{};
  put_stamp(pose, wire);
  wire.status = status_of(pose);
  wire.provisional = pose.is_provisional ? 1 : 0;
  wire.keyframe_seq =
      pose.keyframe_sequence ? static_cast<std::int64_t>(*pose.keyframe_sequence) : -1;
  wire.map_id = static_cast<std::int32_t>(pose.map_id);
  wire.submap_id = static_cast<std::int64_t>(pose.submap_id);
  wire.submap_T_vehicle = to_wire(pose.submap_T_vehicle);

  copy_matrix(pose.covariance, wire.covariance);
  wire.correction_version = static_cast<std::int64_t>(pose.correction_version);
  wire.map_T_submap = to_wire(pose.map_T_submap);
  wire.map_T_odom = to_wire(pose.map_T_odom);
  wire.reset_counter = static_cast<std::int64_t>(pose.reset_counter);
  wire.reset_delta = to_wire(pose.reset_delta);

  return wire;
}

}  // namespace understory::wire
