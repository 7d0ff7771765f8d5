#include <cmath>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

Detection detection(const detection_t& wire, Checks& checks) {
  check_landmark(wire, checks);
  Detection result;
  result.position_m = Eigen::Map<const Eigen::Vector3d>(wire.position_m);
  result.covariance_m2 = checks.covariance("covariance_m2", wire.covariance_m2);
  result.radius_m = wire.radius_m;
  result.kind = static_cast<LandmarkKind>(wire.kind);
  return result;
}

}  // namespace

pose2_t to_wire(const SE2& pose) {
  pose2_t wire{};
  wire.x = pose.x();
  wire.y = pose.y();
  wire.theta = pose.theta();
  return wire;
}

SE2 from_wire(const pose2_t& pose) { return {pose.x, pose.y, pose.theta}; }

Result<LandmarkScan> from_wire(const landmarks_t& wire) {
  Checks checks;
  LandmarkScan scan;
  scan.utime = wire.utime;
  scan.sequence = static_cast<std::uint64_t>(wire.seq);
  scan.field_of_view = field_of_view(wire, checks);
  scan.detections.reserve(wire.detections.size());
  for (std::size_t i = 0; i < wire.detections.size(); ++i) {
    checks.in("detections", i);
    scan.detections.push_back(detection(wire.detections[i], checks));
  }
  if (checks.refusal()) return *checks.refusal();
  return scan;
}

landmarks_t to_wire(const LandmarkScan& scan) {
  landmarks_t wire{};
  wire.utime = scan.utime;
  wire.seq = static_cast<std::int64_t>(scan.sequence);
  copy_field_of_view(scan.field_of_view, wire);
  wire.num_detections = static_cast<std::int32_t>(scan.detections.size());
  wire.detections.reserve(scan.detections.size());
  for (const Detection& detection : scan.detections) {
    detection_t& out = wire.detections.emplace_back();
    copy_vector(detection.position_m, out.position_m);
    copy_matrix(detection.covariance_m2, out.covariance_m2);
    out.radius_m = detection.radius_m;
    out.kind = static_cast<std::int8_t>(detection.kind);
  }
  return wire;
}

Result<Odometry> from_wire(const odometry_t& wire) {
  Checks checks;
  checks.consistent(wire.from_utime >= 0 && wire.from_utime <= wire.utime, "from_utime <= utime");
  checks.pose("from_T_to", wire.from_T_to);
  Odometry odometry;
  odometry.from_utime = wire.from_utime;
  odometry.utime = wire.utime;
  odometry.sequence = static_cast<std::uint64_t>(wire.seq);
  odometry.from_T_to = from_wire(wire.from_T_to);
  odometry.covariance = checks.covariance("covariance", wire.covariance);
  if (checks.refusal()) return *checks.refusal();
  return odometry;
}

odometry_t to_wire(const Odometry& odometry) {
  odometry_t wire{};
  wire.utime = odometry.utime;
  wire.seq = static_cast<std::int64_t>(odometry.sequence);
  wire.from_utime = odometry.from_utime;
  wire.from_T_to = to_wire(odometry.from_T_to);
  copy_matrix(odometry.covariance, wire.covariance);
  return wire;
}

Result<PlanarScan> from_wire(const lidar_scan_t& wire) {
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
  PlanarScan scan;
  scan.utime = wire.utime;
  scan.sequence = static_cast<std::uint64_t>(wire.seq);
  scan.first_bearing_rad = wire.start_angle_rad;
  scan.bearing_step_rad = wire.angle_step_rad;
  scan.max_range_m = wire.max_range_m;
  scan.ranges_m = wire.ranges_m;
  return scan;
}

lidar_scan_t to_wire(const PlanarScan& scan) {
  lidar_scan_t wire{};
  wire.utime = scan.utime;
  wire.seq = static_cast<std::int64_t>(scan.sequence);
  wire.start_angle_rad = scan.first_bearing_rad;
  wire.angle_step_rad = scan.bearing_step_rad;
  wire.max_range_m = scan.max_range_m;
  wire.num_ranges = static_cast<std::int32_t>(scan.ranges_m.size());
  wire.ranges_m.reserve(scan.ranges_m.size());
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    wire.ranges_m.push_back(scan.is_return(beam) ? scan.ranges_m[beam] : 0.0F);
  }
  return wire;
}

Result<WheelSample> from_wire(const wheels_t& wire) {
  Checks checks;
  checks.range("speed_m_s", wire.speed_m_s, -200.0, 200.0);
  checks.range("steering_rad", wire.steering_rad, -std::numbers::pi, std::numbers::pi);
  if (checks.refusal()) return *checks.refusal();
  WheelSample sample;
  sample.utime = wire.utime;
  sample.sequence = static_cast<std::uint64_t>(wire.seq);
  sample.speed_mps = wire.speed_m_s;
  sample.steering_rad = wire.steering_rad;
  return sample;
}

wheels_t to_wire(const WheelSample& sample) {
  wheels_t wire{};
  wire.utime = sample.utime;
  wire.seq = static_cast<std::int64_t>(sample.sequence);
  wire.speed_m_s = sample.speed_mps;
  wire.steering_rad = sample.steering_rad;
  return wire;
}

Result<GnssFix> from_wire(const gnss_t& wire) {
  if (wire.valid == 0) return Refusal{Reason::kInconsistent, "the receiver has no fix"};
  Checks checks;
  checks.range("east_m", wire.east_m, -kFarthestPositionM, kFarthestPositionM);
  checks.range("north_m", wire.north_m, -kFarthestPositionM, kFarthestPositionM);
  checks.range("sigma_m", wire.sigma_m, 0.0, kFarthestPositionM);
  if (checks.refusal()) return *checks.refusal();
  GnssFix fix;
  fix.utime = wire.utime;
  fix.sequence = static_cast<std::uint64_t>(wire.seq);
  fix.east_north_m = {wire.east_m, wire.north_m};
  return fix;
}

gnss_t to_wire(const GnssFix& fix) {
  gnss_t wire{};
  wire.utime = fix.utime;
  wire.seq = static_cast<std::int64_t>(fix.sequence);
  wire.valid = 1;
  wire.east_m = fix.east_north_m.x();
  wire.north_m = fix.east_north_m.y();
  return wire;
}

}  // namespace understory
