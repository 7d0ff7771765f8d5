// The part of MotionEstimator that makes ODOMETRY.
#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/motion_estimator.hpp"

namespace understory::lidar_imu_input {
namespace {

double square(double value) { return value * value; }
double seconds_between(model::Utime from, model::Utime to) {
  return static_cast<double>(to - from) * 1e-6;
}

}  // namespace

geometry::SE2WithCovariance MotionEstimator::dead_reckoned(
    const std::deque<LevelSample>& samples, const model::Preintegration& inertial) const {
  const model::Utime from = samples.front().utime;
  const double dt = inertial.seconds;
  geometry::SE2WithCovariance motion;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  if (const auto then = history_.at(from)) {
    const RollPitchYaw angles = roll_pitch_yaw(then->odom_Q_vehicle);
    const Eigen::Quaterniond level_Q_vehicle(
        Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitX()));
    velocity = (level_Q_vehicle * then->velocity_mps).head<2>();
  }
  motion.mean = geometry::SE2(velocity * dt + inertial.position_m, inertial.yaw_rad);
  // The velocity's error lasts: it has the power tau * dt when pieces are compounded.
  const double power = dt * std::max(dt, parameters_.output.velocity_correlation_s);
  const Eigen::Matrix2d turn = motion.mean.rotation().transpose();
  const Eigen::Matrix2d position = attitude_->velocity_covariance().topLeftCorner<2, 2>() * power +
                                   inertial.covariance.bottomRightCorner<2, 2>();
  motion.covariance.topLeftCorner<2, 2>() = turn * position * turn.transpose();
  motion.covariance(2, 2) =
      inertial.covariance(0, 0) +
      square(stationary_bias_sigma_) * dt * parameters_.wheels.noise.correlation_time_s;
  return motion;
}

std::optional<model::Odometry> MotionEstimator::inertial_increment(model::Utime from,
                                                                   model::Utime to) {
  const auto samples = levels_.between(from, to);
  if (!samples) return std::nullopt;
  model::Odometry odometry;
  const model::InertialBias bias(stationary_bias_, 0.0, 0.0);
  odometry.inertial = preintegrate(*samples, parameters_.imu, bias);
  odometry.inertial->level = attitude_->level_since_mark();
  odometry.is_stationary = moved_utime_ <= from;
  const double twist = odometry.is_stationary ? 0.0 : attitude_->twist_since_mark_rad();
  odometry.inertial->yaw_rad += twist;
  attitude_->mark_level();
  geometry::SE2WithCovariance motion;
  if (const auto driven = drive(*samples, speeds_, parameters_, yaw_rate_bias())) {
    motion = *driven;
    odometry.has_wheels = true;
  } else if (odometry.is_stationary) {
    const WheelNoise& noise = parameters_.wheels.noise;
    motion.covariance.diagonal() << square(noise.standstill_sigma_m),
        square(noise.standstill_sigma_m), square(noise.standstill_sigma_rad);
    motion.covariance *= odometry.inertial->seconds;
  } else {
    motion = dead_reckoned(*samples, *odometry.inertial);
  }
  odometry.from_T_to = motion.mean * geometry::SE2(0.0, 0.0, twist);
  odometry.covariance = motion.covariance;
  return odometry;
}

std::optional<model::Odometry> MotionEstimator::wheel_increment(model::Utime from,
                                                                model::Utime to) {
  auto odometry = wheel_only_.advance_to(to);
  if (!odometry || odometry->from_utime != from) return std::nullopt;
  odometry->has_wheels = true;
  return odometry;
}

std::optional<model::Odometry> MotionEstimator::increment(model::Utime from, model::Utime to) {
  if (to <= from) return std::nullopt;
  // Both are asked: each keeps its place.
  std::optional<model::Odometry> by_wheels = wheel_increment(from, to);
  std::optional<model::Odometry> odometry = inertial_increment(from, to);
  levels_.forget_before(to);
  if (!odometry && by_wheels) {
    odometry = by_wheels;
    // The dead reckoning goes on with it where no sample of the IMU has moved it.
    const model::Utime reached = std::max(from, pose_utime_.value_or(from));
    if (reached < to) {
      const double share = seconds_between(reached, to) / seconds_between(from, to);
      reckoning_.bridge(
          {geometry::SE2::Exp(share * odometry->from_T_to.Log()), share * odometry->covariance});
      if (history_.empty()) history_.add({.utime = reached});
      MotionState state = history_.newest();
      state.utime = to;
      state.heading_rad = reckoning_.pose().theta();
      const RollPitchYaw tilt = roll_pitch_yaw(state.odom_Q_vehicle);
      state.odom_Q_vehicle = Eigen::AngleAxisd(state.heading_rad, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(tilt.pitch_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(tilt.roll_rad, Eigen::Vector3d::UnitX());
      state.position_m.head<2>() = reckoning_.pose().translation();
      const Eigen::Vector3d twist = odometry->from_T_to.Log() / seconds_between(from, to);
      state.velocity_mps << twist.head<2>(), 0.0;
      state.level_velocity_mps = twist.head<2>();
      state.rate_rad_s = Eigen::Vector3d(0.0, 0.0, twist.z());
      history_.add(state);
      pose_utime_ = to;
    }
  }
  if (!odometry) return std::nullopt;
  odometry->from_utime = from;
  odometry->utime = to;
  odometry->sequence = sequence_++;
  return odometry;
}

}  // namespace understory::lidar_imu_input
