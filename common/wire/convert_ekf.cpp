#include <limits>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

constexpr double kLargestBias = 100.0;
constexpr double kLargestLevel_rad = 1.6;

template <std::size_t N>
void check_all(std::string_view field, const double (&values)[N], double limit, Checks& checks) {
  for (const double value : values) checks.range(field, value, -limit, limit);
}

}  // namespace

Result<model::RawPose> from_wire(const raw_pose_t& wire) {
  Checks checks;
  checks.pose("odom_T_vehicle", wire.odom_T_vehicle);
  model::RawPose pose;
  take_stamp(wire, pose);
  pose.odom_T_vehicle = from_wire(wire.odom_T_vehicle);
  pose.covariance = checks.covariance("covariance", wire.covariance);
  pose.is_reference = wire.is_reference != 0;
  return checks.result(pose);
}

raw_pose_t to_wire(const model::RawPose& pose) {
  raw_pose_t wire{};
  put_stamp(pose, wire);
  wire.odom_T_vehicle = to_wire(pose.odom_T_vehicle);
  copy_matrix(pose.covariance, wire.covariance);
  wire.is_reference = pose.is_reference ? 1 : 0;
  return wire;
}

Result<model::EkfPose> from_wire(const ekf_pose_t& wire) {
  Checks checks;
  checks.pose("ekf_map_T_vehicle", wire.ekf_map_T_vehicle);
  check_all("velocity_m_s", wire.velocity_m_s, kFastestMps, checks);
  check_all("bias", wire.bias, kLargestBias, checks);
  checks.range("landmarks_used", wire.landmarks_used, 0, std::numeric_limits<std::int32_t>::max());
  checks.range("landmarks_refused", wire.landmarks_refused, 0,
               std::numeric_limits<std::int32_t>::max());
  checks.range("reset_counter", static_cast<double>(wire.reset_counter), 0.0, 9.3e18);

  model::EkfPose pose;
  take_stamp(wire, pose);
  pose.ekf_map_T_vehicle = from_wire(wire.ekf_map_T_vehicle);
  pose.covariance = checks.covariance("covariance", wire.covariance);
  pose.velocity_mps = Eigen::Map<const Eigen::Vector2d>(wire.velocity_m_s);
  pose.velocity_covariance = checks.covariance("velocity_covariance", wire.velocity_covariance);
  pose.bias = Eigen::Map<const Eigen::Vector3d>(wire.bias);
  pose.bias_covariance = checks.covariance("bias_covariance", wire.bias_covariance);
  pose.landmarks_used = static_cast<std::uint32_t>(wire.landmarks_used);
  pose.landmarks_refused = static_cast<std::uint32_t>(wire.landmarks_refused);
  pose.reset_counter = static_cast<std::uint64_t>(wire.reset_counter);
  return checks.result(pose);
}

ekf_pose_t to_wire(const model::EkfPose& pose) {
  ekf_pose_t wire{};
  put_stamp(pose, wire);
  wire.ekf_map_T_vehicle = to_wire(pose.ekf_map_T_vehicle);
  copy_matrix(pose.covariance, wire.covariance);
  copy_vector(pose.velocity_mps, wire.velocity_m_s);
  copy_matrix(pose.velocity_covariance, wire.velocity_covariance);

  copy_vector(pose.bias, wire.bias);
  copy_matrix(pose.bias_covariance, wire.bias_covariance);
  wire.landmarks_used = static_cast<std::int32_t>(pose.landmarks_used);
  wire.landmarks_refused = static_cast<std::int32_t>(pose.landmarks_refused);
  wire.reset_counter = static_cast<std::int64_t>(pose.reset_counter);

  return wire;
}

Result<model::EkfMap> from_wire(const ekf_map_t& wire) {
  Checks checks;
  model::EkfMap map;
  take_stamp(wire, map);
  map.landmarks.reserve(wire.landmarks.size());

  for (std::size_t i = 0; i < wire.landmarks.size(); ++i) {
    const ekf_landmark_t& from = wire.landmarks[i];
    checks.in("landmarks", i);
    check_landmark(from, checks);
    checks.range("track_id", static_cast<double>(from.track_id), 1.0, 9.3e18);
    checks.range("times_seen", from.times_seen, 0, std::numeric_limits<std::int32_t>::max());
    model::EkfLandmark& landmark = map.landmarks.emplace_back();
    landmark.track_id = static_cast<model::TrackId>(from.track_id);
    landmark.position_m = Eigen::Map<const Eigen::Vector2d>(from.position_m);
    landmark.covariance_m2 = checks.covariance("covariance_m2", from.covariance_m2);
    landmark.radius_m = from.radius_m;
    landmark.kind = static_cast<model::LandmarkKind>(from.kind);
    landmark.observation_count = static_cast<std::uint32_t>(from.times_seen);
  }
  return checks.result(map);
}

ekf_map_t to_wire(const model::EkfMap& map) {
  ekf_map_t wire{};
  put_stamp(map, wire);
  wire.num_landmarks = static_cast<std::int32_t>(map.landmarks.size());
  wire.landmarks.reserve(map.landmarks.size());

  for (const model::EkfLandmark& landmark : map.landmarks) {
    ekf_landmark_t& out = wire.landmarks.emplace_back();
    out.track_id = static_cast<std::int64_t>(landmark.track_id);
    copy_vector(landmark.position_m, out.position_m);
    copy_matrix(landmark.covariance_m2, out.covariance_m2);
    out.radius_m = landmark.radius_m;
    out.kind = static_cast<std::int8_t>(landmark.kind);
    out.times_seen = static_cast<std::int32_t>(landmark.observation_count);
  }

  return wire;
}

Result<model::EkfLevel> from_wire(const ekf_level_t& wire) {
  Checks checks;
  check_all("error_rad", wire.error_rad, kLargestLevel_rad, checks);
  model::EkfLevel level;
  take_stamp(wire, level);
  level.error_rad = Eigen::Map<const Eigen::Vector2d>(wire.error_rad);
  level.covariance = checks.covariance("covariance", wire.covariance);
  level.reported_covariance = checks.covariance("told_covariance", wire.told_covariance);
  return checks.result(level);
}

ekf_level_t to_wire(const model::EkfLevel& level) {
  ekf_level_t wire{};
  put_stamp(level, wire);
  copy_vector(level.error_rad, wire.error_rad);
  copy_matrix(level.covariance, wire.covariance);
  copy_matrix(level.reported_covariance, wire.told_covariance);
  return wire;
}

namespace {

/// Common part of all versions of REST_LEVEL.
template <class Wire>
model::RestLevel rest_level(const Wire& wire, Checks& checks) {
  checks.consistent(wire.rest_from_utime >= 0 && wire.rest_from_utime <= wire.rest_utime &&
                        wire.rest_utime <= wire.utime,
                    "rest_from_utime <= rest_utime <= utime");
  check_all("error_rad", wire.error_rad, kLargestLevel_rad, checks);
  model::RestLevel level;
  take_stamp(wire, level);
  level.rest_from_utime = wire.rest_from_utime;
  level.rest_utime = wire.rest_utime;
  level.error_rad = Eigen::Map<const Eigen::Vector2d>(wire.error_rad);
  level.covariance = checks.covariance("covariance", wire.covariance);
  level.change_covariance = level.covariance;
  return level;
}

}  // namespace

Result<model::RestLevel> from_wire(const rest_level_t& wire) {
  Checks checks;
  model::RestLevel level = rest_level(wire, checks);
  return checks.result(level);
}

Result<model::RestLevel> from_wire(const rest_level2_t& wire) {
  Checks checks;
  model::RestLevel level = rest_level(wire, checks);
  level.change_covariance = checks.covariance("change_covariance", wire.change_covariance);
  return checks.result(level);
}

rest_level2_t to_wire(const model::RestLevel& level) {
  rest_level2_t wire{};
  put_stamp(level, wire);
  wire.rest_from_utime = level.rest_from_utime;
  wire.rest_utime = level.rest_utime;
  copy_vector(level.error_rad, wire.error_rad);
  copy_matrix(level.covariance, wire.covariance);
  copy_matrix(level.change_covariance, wire.change_covariance);
  return wire;
}

Result<model::VelocityCorrection> from_wire(const velocity_correction_t& wire) {
  Checks checks;
  check_all("velocity_m_s", wire.velocity_m_s, kFastestMps, checks);
  check_all("bias", wire.bias, kLargestBias, checks);
  model::VelocityCorrection correction;
  take_stamp(wire, correction);
  correction.velocity_mps = Eigen::Map<const Eigen::Vector2d>(wire.velocity_m_s);
  correction.bias = Eigen::Map<const Eigen::Vector3d>(wire.bias);
  correction.covariance = checks.covariance("covariance", wire.covariance);
  return checks.result(correction);
}

velocity_correction_t to_wire(const model::VelocityCorrection& correction) {
  velocity_correction_t wire{};
  put_stamp(correction, wire);
  copy_vector(correction.velocity_mps, wire.velocity_m_s);
  copy_vector(correction.bias, wire.bias);
  copy_matrix(correction.covariance, wire.covariance);
  return wire;
}

}  // namespace understory::wire
