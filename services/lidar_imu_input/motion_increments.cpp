#include "services/lidar_imu_input/motion_increments.hpp"

#include <algorithm>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// Velocity in `vehicle_level` at a state of the history.
Eigen::Vector2d level_velocity(const MotionState& state) {
  const RollPitchYaw angles = roll_pitch_yaw(state.odom_Q_vehicle);
  const Eigen::Quaterniond level_Q_vehicle(
      Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitX()));
  return (level_Q_vehicle * state.velocity_mps).head<2>();
}

/// Motion of a stationary vehicle: zero, with the noise of the model.
geometry::SE2WithCovariance no_motion(const WheelNoise& noise, double seconds) {
  geometry::SE2WithCovariance motion;
  motion.covariance.diagonal() << square(noise.standstill_sigma_m),
      square(noise.standstill_sigma_m), square(noise.standstill_sigma_rad);
  motion.covariance *= seconds;
  return motion;
}

}  // namespace

MotionIncrements::MotionIncrements(const LidarImuInputParameters& parameters)
    : parameters_(parameters), levels_(parameters.imu.max_gap_s), wheel_only_(parameters.wheels) {}

std::optional<model::Odometry> MotionIncrements::make(model::Utime from, model::Utime to,
                                                      const IncrementSources& sources) {
  if (to <= from) return std::nullopt;

  // Both are called: each keeps its own end of the last interval.
  const std::optional<model::Odometry> wheels = by_wheels(from, to);
  std::optional<model::Odometry> odometry = by_imu(from, to, sources);
  levels_.forget_before(to);

  if (!odometry) odometry = wheels;
  if (!odometry) return std::nullopt;
  odometry->from_utime = from;
  odometry->utime = to;
  odometry->sequence = sequence_++;
  return odometry;
}

std::optional<model::Odometry> MotionIncrements::by_wheels(model::Utime from, model::Utime to) {
  auto odometry = wheel_only_.advance_to(to);
  if (!odometry || odometry->from_utime != from) return std::nullopt;
  odometry->has_wheels = true;
  return odometry;
}

std::optional<model::Odometry> MotionIncrements::by_imu(model::Utime from, model::Utime to,
                                                        const IncrementSources& sources) {
  const auto samples = levels_.between(from, to);
  if (!samples) return std::nullopt;

  // Preintegration with the bias estimated while stationary; the accelerometer's keeps its prior.
  model::Odometry odometry;
  const model::InertialBias bias(sources.stationary.bias().bias_rad_s, 0.0, 0.0);
  odometry.inertial = preintegrate(*samples, parameters_.imu, bias);

  // Propagation of the level error. On a slope a correction of the roll rotates the heading, too.
  AttitudeFilter& attitude = *sources.attitude;
  odometry.inertial->level = attitude.level_since_mark();
  odometry.is_stationary = sources.stationary.is_stationary_since(from);
  const double twist = odometry.is_stationary ? 0.0 : attitude.twist_since_mark_rad();
  odometry.inertial->yaw_rad += twist;
  attitude.mark_level();

  // The same motion in the plane.
  const geometry::SE2WithCovariance motion = planar_motion(*samples, sources, odometry);
  odometry.from_T_to = motion.mean * geometry::SE2(0.0, 0.0, twist);
  odometry.covariance = motion.covariance;
  return odometry;
}

/// From the wheels' speed, if available; sets `odometry.has_wheels`.
geometry::SE2WithCovariance MotionIncrements::planar_motion(const std::deque<LevelSample>& samples,
                                                            const IncrementSources& sources,
                                                            model::Odometry& odometry) const {
  if (const auto driven = drive(samples, sources.speeds, parameters_, sources.stationary.bias())) {
    odometry.has_wheels = true;
    return *driven;
  }
  if (odometry.is_stationary)
    return no_motion(parameters_.wheels.noise, odometry.inertial->seconds);
  return dead_reckoned(samples, *odometry.inertial, sources);
}

geometry::SE2WithCovariance MotionIncrements::dead_reckoned(const std::deque<LevelSample>& samples,
                                                            const model::Preintegration& inertial,
                                                            const IncrementSources& sources) const {
  const double dt = inertial.seconds;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  if (const auto then = sources.history.at(samples.front().utime)) velocity = level_velocity(*then);

  geometry::SE2WithCovariance motion;
  motion.mean = geometry::SE2(velocity * dt + inertial.position_m, inertial.yaw_rad);

  // The velocity's error is correlated: its power is tau * dt when increments are compounded.
  const double power = dt * std::max(dt, parameters_.output.velocity_correlation_s);
  const Eigen::Matrix2d rotation = motion.mean.rotation().transpose();
  const Eigen::Matrix2d position =
      sources.attitude->velocity_covariance().topLeftCorner<2, 2>() * power +
      inertial.covariance.bottomRightCorner<2, 2>();
  motion.covariance.topLeftCorner<2, 2>() = rotation * position * rotation.transpose();
  motion.covariance(2, 2) =
      inertial.covariance(0, 0) + square(sources.stationary.bias().sigma_rad_s) * dt *
                                      parameters_.wheels.noise.correlation_time_s;
  return motion;
}

}  // namespace understory::lidar_imu_input
