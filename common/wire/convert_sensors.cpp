#include <cmath>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

model::Detection detection(const detection_t& wire, Checks& checks) {
  check_landmark(wire, checks);
  model::Detection result;
  result.position_m = Eigen::Map<const Eigen::Vector3d>(wire.position_m);
  result.covariance_m2 = checks.covariance("covariance_m2", wire.covariance_m2);
  result.radius_m = wire.radius_m;
  result.kind = static_cast<model::LandmarkKind>(wire.kind);
  checks.range("bearing_rad", wire.bearing_rad, -kTurn, kTurn);
  checks.range("bearing_sigma_rad", wire.bearing_sigma_rad, 0.0, kTurn);
  result.bearing_rad = wire.bearing_rad;
  result.bearing_sigma_rad = wire.bearing_sigma_rad;
  return result;
}

detection_t to_wire(const model::Detection& detection) {
  detection_t out{};
  copy_vector(detection.position_m, out.position_m);
  copy_matrix(detection.covariance_m2, out.covariance_m2);
  out.radius_m = detection.radius_m;
  out.kind = static_cast<std::int8_t>(detection.kind);
  out.bearing_rad = detection.bearing_rad;
  out.bearing_sigma_rad = detection.bearing_sigma_rad;
  return out;
}

model::Preintegration preintegration(const preintegration_t& wire, Checks& checks) {
  checks.range("seconds", wire.seconds, 0.0, 1e5);
  checks.range("yaw_rad", wire.yaw_rad, -1e5, 1e5);
  model::Preintegration result;
  result.seconds = wire.seconds;
  result.yaw_rad = wire.yaw_rad;
  result.velocity_mps = Eigen::Map<const Eigen::Vector2d>(wire.velocity_m_s);
  result.position_m = Eigen::Map<const Eigen::Vector2d>(wire.position_m);

  checks.range("velocity_m_s", result.velocity_mps.cwiseAbs().maxCoeff(), 0.0, 1e6);
  checks.range("position_m", result.position_m.cwiseAbs().maxCoeff(), 0.0, kFarthestPositionM);
  result.covariance = checks.covariance("covariance", wire.covariance);
  result.bias_jacobian =
      Eigen::Map<const Eigen::Matrix<double, 5, 3, Eigen::RowMajor>>(&wire.bias_jacobian[0][0]);
  result.bias = Eigen::Map<const Eigen::Vector3d>(wire.bias);

  return result;
}

preintegration_t to_wire(const model::Preintegration& value) {
  preintegration_t wire{};
  wire.seconds = value.seconds;
  wire.yaw_rad = value.yaw_rad;
  copy_vector(value.velocity_mps, wire.velocity_m_s);
  copy_vector(value.position_m, wire.position_m);
  copy_matrix(value.covariance, wire.covariance);
  for (int row = 0; row < 5; ++row) {
    copy_vector(value.bias_jacobian.row(row), wire.bias_jacobian[row]);
  }
  copy_vector(value.bias, wire.bias);
  return wire;
}

model::LevelError level_error(const level_error_t& wire, Checks& checks) {
  checks.in("level", 0);
  model::LevelError result;
  result.covariance = checks.covariance("covariance", wire.covariance);
  result.added = checks.covariance("added", wire.added);
  result.memory =
      Eigen::Map<const Eigen::Matrix<double, 2, 2, Eigen::RowMajor>>(&wire.memory[0][0]);
  checks.range("memory", result.memory.cwiseAbs().maxCoeff(), 0.0, 1e3);
  checks.range("pitch_tangent", wire.pitch_tangent, -1e3, 1e3);
  result.pitch_tangent = wire.pitch_tangent;
  checks.in_message();
  return result;
}

level_error_t to_wire(const model::LevelError& value) {
  level_error_t wire{};
  copy_matrix(value.covariance, wire.covariance);
  copy_matrix(value.memory, wire.memory);
  copy_matrix(value.added, wire.added);
  wire.pitch_tangent = value.pitch_tangent;
  return wire;
}

/// Common part of both versions.
template <class Wire>
model::Odometry odometry(const Wire& wire, Checks& checks) {
  checks.consistent(wire.from_utime >= 0 && wire.from_utime <= wire.utime, "from_utime <= utime");
  checks.pose("from_T_to", wire.from_T_to);
  model::Odometry odometry;
  odometry.from_utime = wire.from_utime;
  take_stamp(wire, odometry);
  odometry.from_T_to = from_wire(wire.from_T_to);
  odometry.covariance = checks.covariance("covariance", wire.covariance);
  odometry.has_wheels = wire.has_wheels != 0;
  odometry.is_stationary = wire.is_standing != 0;
  checks.range("num_inertial", wire.num_inertial, 0, 1);
  if (wire.num_inertial == 1) odometry.inertial = preintegration(wire.inertial[0], checks);

  return odometry;
}

}  // namespace

pose2_t to_wire(const geometry::SE2& pose) {
  pose2_t wire{};
  wire.x = pose.x();
  wire.y = pose.y();
  wire.theta = pose.theta();
  return wire;
}

geometry::SE2 from_wire(const pose2_t& pose) { return {pose.x, pose.y, pose.theta}; }

Result<model::LandmarkScan> from_wire(const landmarks_t& wire) {
  Checks checks;
  model::LandmarkScan scan;
  take_stamp(wire, scan);
  scan.field_of_view = field_of_view(wire, checks);
  scan.detections.reserve(wire.detections.size());
  for (std::size_t i = 0; i < wire.detections.size(); ++i) {
    checks.in("detections", i);
    scan.detections.push_back(detection(wire.detections[i], checks));
  }
  return checks.result(scan);
}

landmarks_t to_wire(const model::LandmarkScan& scan) {
  landmarks_t wire{};
  put_stamp(scan, wire);
  copy_field_of_view(scan.field_of_view, wire);
  wire.num_detections = static_cast<std::int32_t>(scan.detections.size());
  wire.detections.reserve(scan.detections.size());
  for (const model::Detection& detection : scan.detections) {
    wire.detections.push_back(to_wire(detection));
  }
  return wire;
}

Result<model::Odometry> from_wire(const odometry_t& wire) {
  Checks checks;
  model::Odometry value = odometry(wire, checks);
  return checks.result(value);
}

Result<model::Odometry> from_wire(const odometry2_t& wire) {
  Checks checks;
  model::Odometry value = odometry(wire, checks);
  checks.consistent(wire.num_level == wire.num_inertial, "num_level = num_inertial");
  if (checks.refusal()) return *checks.refusal();
  if (value.inertial) value.inertial->level = level_error(wire.level[0], checks);
  return checks.result(value);
}

odometry2_t to_wire(const model::Odometry& odometry) {
  odometry2_t wire{};
  put_stamp(odometry, wire);
  wire.from_utime = odometry.from_utime;
  wire.from_T_to = to_wire(odometry.from_T_to);
  copy_matrix(odometry.covariance, wire.covariance);
  wire.has_wheels = odometry.has_wheels ? 1 : 0;
  wire.is_standing = odometry.is_stationary ? 1 : 0;
  if (odometry.inertial) wire.inertial.push_back(to_wire(*odometry.inertial));
  wire.num_inertial = static_cast<std::int32_t>(wire.inertial.size());
  if (odometry.inertial) wire.level.push_back(to_wire(odometry.inertial->level));
  wire.num_level = wire.num_inertial;

  return wire;
}

Result<model::PlanarScan> from_wire(const lidar_scan_t& wire) {
  Checks checks;
  checks.pose("vehicle_T_sensor", wire.vehicle_T_sensor);
  checks.range("start_angle_rad", wire.start_angle_rad, -2.0 * kTurn, 2.0 * kTurn);
  checks.range("angle_step_rad", wire.angle_step_rad, -kTurn, kTurn);
  checks.range("max_range_m", wire.max_range_m, 0.0, kLongestRangeM);
  checks.range("beam_interval_s", wire.beam_interval_s, 0.0, 10.0);
  checks.consistent(wire.num_intensities == 0 || wire.num_intensities == wire.num_ranges,
                    "num_intensities = num_ranges or 0");

  for (std::size_t i = 0; i < wire.ranges_m.size(); ++i) {
    checks.in("ranges_m", i);
    checks.range("value", wire.ranges_m[i], 0.0, kLongestRangeM);
  }

  if (checks.refusal()) return *checks.refusal();
  model::PlanarScan scan;
  take_stamp(wire, scan);
  scan.first_bearing_rad = wire.start_angle_rad;
  scan.bearing_step_rad = wire.angle_step_rad;
  scan.max_range_m = wire.max_range_m;
  scan.ranges_m = wire.ranges_m;
  scan.beam_interval_s = wire.beam_interval_s;
  scan.vehicle_T_sensor = from_wire(wire.vehicle_T_sensor);
  return scan;
}

lidar_scan_t to_wire(const model::PlanarScan& scan) {
  lidar_scan_t wire{};
  put_stamp(scan, wire);
  wire.start_angle_rad = scan.first_bearing_rad;
  wire.angle_step_rad = scan.bearing_step_rad;
  wire.max_range_m = scan.max_range_m;
  wire.beam_interval_s = scan.beam_interval_s;
  wire.vehicle_T_sensor = to_wire(scan.vehicle_T_sensor);
  wire.num_ranges = static_cast<std::int32_t>(scan.ranges_m.size());
  wire.ranges_m.reserve(scan.ranges_m.size());
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    wire.ranges_m.push_back(scan.is_return(beam) ? scan.ranges_m[beam] : 0.0F);
  }
  return wire;
}

Result<model::WheelSample> from_wire(const wheels_t& wire) {
  Checks checks;
  checks.range("speed_m_s", wire.speed_m_s, -200.0, 200.0);
  checks.range("steering_rad", wire.steering_rad, -std::numbers::pi, std::numbers::pi);
  if (checks.refusal()) return *checks.refusal();
  model::WheelSample sample;
  take_stamp(wire, sample);
  sample.speed_mps = wire.speed_m_s;
  sample.steering_rad = wire.steering_rad;
  return sample;
}

wheels_t to_wire(const model::WheelSample& sample) {
  wheels_t wire{};
  put_stamp(sample, wire);
  wire.speed_m_s = sample.speed_mps;
  wire.steering_rad = sample.steering_rad;
  return wire;
}

Result<model::ImuSample> from_wire(const imu_t& wire) {
  Checks checks;
  for (int i = 0; i < 3; ++i) {
    checks.range("angular_rate_rad_s", wire.angular_rate_rad_s[i], -1000.0, 1000.0);
    checks.range("specific_force_m_s2", wire.specific_force_m_s2[i], -1e5, 1e5);
  }
  if (checks.refusal()) return *checks.refusal();
  model::ImuSample sample;
  take_stamp(wire, sample);
  sample.angular_rate_rad_s = Eigen::Map<const Eigen::Vector3d>(wire.angular_rate_rad_s);
  sample.specific_force_mps2 = Eigen::Map<const Eigen::Vector3d>(wire.specific_force_m_s2);
  return sample;
}

imu_t to_wire(const model::ImuSample& sample) {
  imu_t wire{};
  put_stamp(sample, wire);
  copy_vector(sample.angular_rate_rad_s, wire.angular_rate_rad_s);
  copy_vector(sample.specific_force_mps2, wire.specific_force_m_s2);
  return wire;
}

Result<model::TrackedScan> from_wire(const tracked_landmarks_t& wire) {
  Checks checks;
  model::TrackedScan scan;
  take_stamp(wire, scan);
  scan.field_of_view = field_of_view(wire, checks);
  scan.landmarks.reserve(wire.landmarks.size());

  for (std::size_t i = 0; i < wire.landmarks.size(); ++i) {
    const tracked_landmark_t& from = wire.landmarks[i];
    checks.in("landmarks", i);
    checks.range("track_id", static_cast<double>(from.track_id), 1.0, 9.3e18);
    checks.range("detection", from.detection, 0, std::numeric_limits<std::int32_t>::max());
    scan.landmarks.push_back({static_cast<model::TrackId>(from.track_id),
                              static_cast<std::uint32_t>(from.detection),
                              detection(from.observed, checks)});
  }
  return checks.result(scan);
}

tracked_landmarks_t to_wire(const model::TrackedScan& scan) {
  tracked_landmarks_t wire{};
  put_stamp(scan, wire);
  copy_field_of_view(scan.field_of_view, wire);
  wire.num_landmarks = static_cast<std::int32_t>(scan.landmarks.size());
  wire.landmarks.reserve(scan.landmarks.size());

  for (const model::TrackedLandmark& landmark : scan.landmarks) {
    tracked_landmark_t& out = wire.landmarks.emplace_back();
    out.track_id = static_cast<std::int64_t>(landmark.track_id);
    out.detection = static_cast<std::int32_t>(landmark.detection);
    out.observed = to_wire(landmark.observed);
  }

  return wire;
}

Result<model::GnssFix> from_wire(const gnss_t& wire) {
  if (wire.valid == 0) return Refusal{Reason::kInconsistent, "the receiver has no fix"};
  Checks checks;
  checks.range("east_m", wire.east_m, -kFarthestPositionM, kFarthestPositionM);
  checks.range("north_m", wire.north_m, -kFarthestPositionM, kFarthestPositionM);
  checks.range("sigma_m", wire.sigma_m, 0.0, kFarthestPositionM);
  checks.range("east_velocity_m_s", wire.east_velocity_m_s, -kFastestMps, kFastestMps);
  checks.range("north_velocity_m_s", wire.north_velocity_m_s, -kFastestMps, kFastestMps);

  checks.range("velocity_sigma_m_s", wire.velocity_sigma_m_s, 0.0, kFastestMps);
  if (checks.refusal()) return *checks.refusal();

  model::GnssFix fix;
  take_stamp(wire, fix);
  fix.east_north_m = {wire.east_m, wire.north_m};
  fix.sigma_m = wire.sigma_m;

  if (wire.has_velocity != 0) {
    fix.velocity_mps = {wire.east_velocity_m_s, wire.north_velocity_m_s};
    fix.velocity_sigma_mps = wire.velocity_sigma_m_s;
  }

  return fix;
}

gnss_t to_wire(const model::GnssFix& fix) {
  gnss_t wire{};
  put_stamp(fix, wire);
  wire.valid = 1;
  wire.east_m = fix.east_north_m.x();
  wire.north_m = fix.east_north_m.y();
  wire.sigma_m = fix.sigma_m;

  if (fix.velocity_mps) {
    wire.has_velocity = 1;
    wire.east_velocity_m_s = fix.velocity_mps->x();
    wire.north_velocity_m_s = fix.velocity_mps->y();
    wire.velocity_sigma_m_s = fix.velocity_sigma_mps;
  }

  return wire;
}

}  // namespace understory::wire
