#include <tuple>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

model::KeyframeMember member(const keyframe_member_t& wire, Checks& checks) {
  checks.range("utime", static_cast<double>(wire.utime), 0.0, 9.1e15);
  checks.range("seq", static_cast<double>(wire.seq), 0.0, 9.3e18);
  checks.pose("centre_T_vehicle", wire.centre_T_vehicle);
  model::KeyframeMember result;
  take_stamp(wire, result);
  result.centre_T_vehicle = from_wire(wire.centre_T_vehicle);
  result.covariance = checks.covariance("covariance", wire.covariance);
  return result;
}

model::KeyframeLandmark landmark(const keyframe_landmark_t& wire, Checks& checks) {
  check_landmark(wire, checks);
  checks.range("times_seen", wire.times_seen, 0, std::numeric_limits<std::uint16_t>::max());
  model::KeyframeLandmark result;
  result.position_m = Eigen::Map<const Eigen::Vector2d>(wire.position_m);
  result.covariance_m2 = checks.covariance("covariance_m2", wire.covariance_m2);
  result.radius_m = wire.radius_m;
  result.observation_count = static_cast<std::uint16_t>(wire.times_seen);
  result.kind = static_cast<model::LandmarkKind>(wire.kind);
  return result;
}

/// Members must be in order of time, and the keyframe must have the first one's stamp.
template <class Wire>
void check_order(const Wire& wire, Checks& checks) {
  checks.in_message();
  checks.consistent(!wire.members.empty(), "num_members >= 1");
  if (wire.members.empty()) return;
  checks.consistent(wire.members.front().utime == wire.utime, "utime = members[0].utime");
  for (std::size_t i = 1; i < wire.members.size(); ++i) {
    checks.consistent(wire.members[i - 1].utime < wire.members[i].utime,
                      "members in order of time");
  }
}

/// Common part of both versions.
template <class Wire>
model::Keyframe keyframe_of(const Wire& wire, Checks& checks) {
  check_order(wire, checks);
  model::Keyframe keyframe;
  take_stamp(wire, keyframe);
  keyframe.field_of_view = field_of_view(wire, checks);

  if (wire.has_previous != 0) {
    checks.pose("previous_T_base", wire.previous_T_base);
    keyframe.previous_T_base = from_wire(wire.previous_T_base);
  }

  keyframe.members.reserve(wire.members.size());
  for (std::size_t i = 0; i < wire.members.size(); ++i) {
    checks.in("members", i);
    keyframe.members.push_back(member(wire.members[i], checks));
  }

  keyframe.landmarks.reserve(wire.landmarks.size());
  for (std::size_t i = 0; i < wire.landmarks.size(); ++i) {
    checks.in("landmarks", i);
    keyframe.landmarks.push_back(landmark(wire.landmarks[i], checks));
  }
  return keyframe;
}

/// Each of a member's detections must belong to one landmark.
std::vector<model::KeyframeDetection> detections(const keyframe2_t& wire, Checks& checks) {
  std::vector<model::KeyframeDetection> result;
  result.reserve(wire.detections.size());
  for (std::size_t i = 0; i < wire.detections.size(); ++i) {
    const keyframe_detection_t& one = wire.detections[i];
    checks.in("detections", i);
    checks.range("member", one.member, 0.0, static_cast<double>(wire.members.size()) - 1.0);
    checks.range("detection", one.detection, 0.0, kMostDetections);
    checks.range("landmark", one.landmark, 0.0, static_cast<double>(wire.landmarks.size()) - 1.0);
    if (i > 0) {
      const keyframe_detection_t& last = wire.detections[i - 1];
      checks.consistent(std::tie(last.member, last.detection) < std::tie(one.member, one.detection),
                        "in order of member and detection");
    }
    result.push_back({static_cast<std::uint32_t>(one.member),
                      static_cast<std::uint32_t>(one.detection),
                      static_cast<std::uint32_t>(one.landmark)});
  }
  return result;
}

}  // namespace

Result<model::Keyframe> from_wire(const keyframe2_t& wire) {
  Checks checks;
  model::Keyframe keyframe = keyframe_of(wire, checks);
  keyframe.detections = detections(wire, checks);
  return checks.result(keyframe);
}

Result<model::Keyframe> from_wire(const keyframe_t& wire) {
  Checks checks;
  model::Keyframe keyframe = keyframe_of(wire, checks);
  return checks.result(keyframe);
}

keyframe2_t to_wire(const model::Keyframe& keyframe) {
  keyframe2_t wire{};
  put_stamp(keyframe, wire);
  copy_field_of_view(keyframe.field_of_view, wire);
  wire.has_previous = keyframe.previous_T_base.has_value() ? 1 : 0;
  wire.previous_T_base = to_wire(keyframe.previous_T_base.value_or(geometry::SE2()));
  wire.num_members = static_cast<std::int32_t>(keyframe.members.size());

  for (const model::KeyframeMember& member : keyframe.members) {
    keyframe_member_t& out = wire.members.emplace_back();
    out.utime = member.utime;
    out.seq = static_cast<std::int64_t>(member.sequence);
    out.centre_T_vehicle = to_wire(member.centre_T_vehicle);
    copy_matrix(member.covariance, out.covariance);
  }

  wire.num_landmarks = static_cast<std::int32_t>(keyframe.landmarks.size());
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
    keyframe_landmark_t& out = wire.landmarks.emplace_back();
    copy_vector(landmark.position_m, out.position_m);
    copy_matrix(landmark.covariance_m2, out.covariance_m2);
    out.radius_m = landmark.radius_m;
    out.times_seen = landmark.observation_count;
    out.kind = static_cast<std::int8_t>(landmark.kind);
  }

  wire.num_detections = static_cast<std::int32_t>(keyframe.detections.size());
  for (const model::KeyframeDetection& one : keyframe.detections) {
    keyframe_detection_t& out = wire.detections.emplace_back();
    out.member = static_cast<std::int16_t>(one.member);
    out.detection = static_cast<std::int32_t>(one.detection);
    out.landmark = static_cast<std::int32_t>(one.landmark);
  }

  return wire;
}

}  // namespace understory::wire
