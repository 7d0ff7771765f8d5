#include "common/wire/convert.hpp"
#include "common/wire/convert_ids.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

model::MapLandmark landmark(const map_landmark_t& wire, Checks& checks) {
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

map_landmark_t to_wire(const model::MapLandmark& landmark) {
  map_landmark_t wire{};
  wire.id = static_cast<std::int64_t>(landmark.id);
  copy_vector(landmark.position_m, wire.position_m);
  copy_matrix(landmark.covariance_m2, wire.covariance_m2);
  wire.radius_m = landmark.radius_m;
  wire.times_seen = static_cast<std::int32_t>(landmark.observation_count);
  wire.kind = static_cast<std::int8_t>(landmark.kind);
  return wire;
}

std::vector<model::MapLandmark> landmarks(std::string_view field,
                                          const std::vector<map_landmark_t>& wire, Checks& checks) {
  std::vector<model::MapLandmark> result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    checks.in(field, i);
    result.push_back(landmark(wire[i], checks));
  }
  return result;
}

std::vector<map_landmark_t> to_wire(const std::vector<model::MapLandmark>& landmarks) {
  std::vector<map_landmark_t> wire;
  wire.reserve(landmarks.size());
  for (const model::MapLandmark& landmark : landmarks) wire.push_back(to_wire(landmark));
  return wire;
}

}  // namespace

Result<model::WholeMap> from_wire(const map_t& wire) {
  Checks checks;
  checks.range("version", static_cast<double>(wire.version), 0.0, 9.3e18);
  model::WholeMap map;
  map.utime = wire.utime;
  map.sequence = static_cast<std::uint64_t>(wire.seq);
  map.version = static_cast<std::uint64_t>(wire.version);
  map.complete = wire.complete != 0;
  map.landmarks = landmarks("landmarks", wire.landmarks, checks);
  map.keyframes.reserve(wire.keyframes.size());
  for (std::size_t i = 0; i < wire.keyframes.size(); ++i) {
    const keyframe_pose_t& one = wire.keyframes[i];
    checks.in("keyframes", i);
    checks.range("keyframe_seq", static_cast<double>(one.keyframe_seq), 0.0, 9.3e18);
    checks.pose("map_T_vehicle", one.map_T_vehicle);
    map.keyframes.push_back({static_cast<std::uint64_t>(one.keyframe_seq), one.utime,
                             from_wire(one.map_T_vehicle),
                             checks.covariance("covariance", one.covariance)});
  }

  if (checks.refusal()) return *checks.refusal();
  return map;
}

map_t to_wire(const model::WholeMap& map) {
  map_t wire{};
  wire.utime = map.utime;
  wire.seq = static_cast<std::int64_t>(map.sequence);
  wire.version = static_cast<std::int64_t>(map.version);
  wire.complete = map.complete ? 1 : 0;
  wire.landmarks = to_wire(map.landmarks);
  wire.num_landmarks = static_cast<std::int32_t>(wire.landmarks.size());
  wire.keyframes.reserve(map.keyframes.size());
  for (const model::KeyframePose& pose : map.keyframes) {
    keyframe_pose_t& out = wire.keyframes.emplace_back();
    out.utime = pose.utime;
    out.keyframe_seq = static_cast<std::int64_t>(pose.keyframe_sequence);
    out.map_T_vehicle = to_wire(pose.map_T_vehicle);
    copy_matrix(pose.covariance, out.covariance);
  }

  wire.num_keyframes = static_cast<std::int32_t>(wire.keyframes.size());
  return wire;
}

Result<model::MapDelta> from_wire(const map_delta_t& wire) {
  Checks checks;
  checks.consistent(wire.base_version >= 0 && wire.base_version < wire.version,
                    "base_version < version");
  model::MapDelta delta;
  delta.utime = wire.utime;
  delta.sequence = static_cast<std::uint64_t>(wire.seq);
  delta.base_version = static_cast<std::uint64_t>(wire.base_version);
  delta.version = static_cast<std::uint64_t>(wire.version);
  delta.added = landmarks("added", wire.added, checks);
  delta.moved = landmarks("moved", wire.moved, checks);
  delta.removed = ids("removed", wire.removed, checks);
  delta.merged = merges(wire.merged, checks);
  if (checks.refusal()) return *checks.refusal();

  return delta;
}

map_delta_t to_wire(const model::MapDelta& delta) {
  map_delta_t wire{};
  wire.utime = delta.utime;
  wire.seq = static_cast<std::int64_t>(delta.sequence);
  wire.base_version = static_cast<std::int64_t>(delta.base_version);
  wire.version = static_cast<std::int64_t>(delta.version);
  wire.added = to_wire(delta.added);
  wire.moved = to_wire(delta.moved);
  wire.removed.assign(delta.removed.begin(), delta.removed.end());
  wire.merged = to_wire(delta.merged);
  copy_counts(wire);
  wire.num_moved = static_cast<std::int32_t>(wire.moved.size());
  return wire;
}

}  // namespace understory::wire
