#include "services/lidar_imu_input/pose_track.hpp"

#include <algorithm>

#include "common/model/level.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {

void PoseTrack::propagate(const LevelSample& from, const LevelSample& to, double climb_mps,
                          double seconds) {
  // If the sample is late, the wheels have moved the pose over a part of its time.
  const model::Utime reached = std::clamp(utime_.value_or(from.utime), from.utime, to.utime);
  const LevelSample middle = interpolate(from, to, reached);
  if (reached > from.utime) reckoning_.propagate_velocity(from, middle);
  if (reached == to.utime) return;
  reckoning_.propagate(reached > from.utime ? middle : from, to);
  height_m_ += climb_mps * (seconds - seconds_between(from.utime, reached));
}

void PoseTrack::bridge_gap(model::Utime utime, double yaw_rate_rad_s) {
  // Time not covered by the wheels.
  const double open = std::max(0.0, seconds_between(*utime_, utime));
  const Eigen::Vector2d& v = reckoning_.velocity();
  geometry::SE2WithCovariance motion{
      geometry::SE2::Exp({v.x() * open, v.y() * open, yaw_rate_rad_s * open}),
      Eigen::Matrix3d::Zero()};
  motion.covariance.diagonal() << square(open), square(open), square(0.2 * open);
  reckoning_.bridge(motion);
}

void PoseTrack::reach(model::Utime utime) { utime_ = std::max(utime, utime_.value_or(utime)); }

void PoseTrack::follow_wheels(const model::Odometry& odometry) {
  const model::Utime from = odometry.from_utime;
  const model::Utime to = odometry.utime;
  const model::Utime reached = std::max(from, utime_.value_or(from));
  if (reached >= to) return;

  // Share of the motion not applied yet.
  const double share = seconds_between(reached, to) / seconds_between(from, to);
  reckoning_.bridge(
      {geometry::SE2::Exp(share * odometry.from_T_to.Log()), share * odometry.covariance});

  // Tilt and height stay at their last values; the uncertainty of the tilt grows.
  if (history_.empty()) history_.add({.utime = reached});
  MotionState state = history_.newest();
  state.utime = to;
  state.heading_rad = reckoning_.pose().theta();
  const RollPitchYaw tilt = roll_pitch_yaw(state.odom_Q_vehicle);
  state.odom_Q_vehicle = Eigen::AngleAxisd(state.heading_rad, Eigen::Vector3d::UnitZ()) *
                         Eigen::AngleAxisd(tilt.pitch_rad, Eigen::Vector3d::UnitY()) *
                         Eigen::AngleAxisd(tilt.roll_rad, Eigen::Vector3d::UnitX());
  state.tilt_covariance =
      model::level_without_imu(state.tilt_covariance, seconds_between(reached, to));
  state.position_m.head<2>() = reckoning_.pose().translation();

  const Eigen::Vector3d twist = odometry.from_T_to.Log() / seconds_between(from, to);
  state.velocity_mps << twist.head<2>(), 0.0;
  state.level_velocity_mps = twist.head<2>();
  state.rate_rad_s = Eigen::Vector3d(0.0, 0.0, twist.z());
  history_.add(state);
  utime_ = to;
}

void PoseTrack::remember(const model::ImuSample& sample, const AttitudeFilter& attitude) {
  if (!history_.empty() && history_.newest().utime >= sample.utime) return;
  history_.add(state_at(sample, attitude));
}

MotionState PoseTrack::state_at(const model::ImuSample& sample,
                                const AttitudeFilter& attitude) const {
  MotionState state;
  state.utime = sample.utime;
  state.heading_rad = reckoning_.pose().theta();
  state.odom_Q_vehicle =
      Eigen::Quaterniond(Eigen::AngleAxisd(state.heading_rad, Eigen::Vector3d::UnitZ())) *
      attitude.level_Q_vehicle();
  state.position_m << reckoning_.pose().translation(), height_m_;
  state.velocity_mps = attitude.velocity();
  state.level_velocity_mps = reckoning_.velocity();
  state.rate_rad_s = sample.angular_rate_rad_s - attitude.gyro_bias();
  state.tilt_covariance = attitude.tilt_covariance();
  return state;
}

model::RawPose PoseTrack::raw_pose(bool is_reference) const {
  model::RawPose pose;
  pose.utime = utime_.value_or(0);
  pose.odom_T_vehicle = reckoning_.pose();
  pose.covariance = reckoning_.pose_covariance();
  pose.is_reference = is_reference;
  return pose;
}

}  // namespace understory::lidar_imu_input
