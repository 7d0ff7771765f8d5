#include "services/lidar_imu_input/level_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// Adds one step of constant rate and force to a preintegration.
void step(model::Preintegration& sum, const LevelSample& a, const LevelSample& b,
          const ImuParameters& imu) {
  const double dt = seconds_between(a.utime, b.utime);
  const double rate = 0.5 * (a.yaw_rate_rad_s + b.yaw_rate_rad_s) - sum.bias(0);

  // Both ends' forces, rotated to the middle of the step.
  const Eigen::Matrix2d back = planar_rotation(-0.5 * rate * dt);
  const Eigen::Vector2d force_bias = sum.bias.tail<2>();
  const Eigen::Vector2d force =
      0.5 * (back * (a.force_mps2 - force_bias) + back.transpose() * (b.force_mps2 - force_bias));
  const Eigen::Matrix2d middle = planar_rotation(sum.yaw_rad + 0.5 * rate * dt);
  const Eigen::Vector2d acceleration = middle * force;
  const Eigen::Vector2d turned = geometry::perpendicular(acceleration);

  // Transition of the error (yaw, velocity, position).
  Eigen::Matrix<double, 5, 5> forward = Eigen::Matrix<double, 5, 5>::Identity();
  forward.block<2, 1>(1, 0) = turned * dt;
  forward.block<2, 1>(3, 0) = 0.5 * turned * dt * dt;
  forward.block<2, 2>(3, 1) = Eigen::Matrix2d::Identity() * dt;

  // Jacobian by the step's mean rate and force (the force rotates by half of the step's own
  // rotation).
  Eigen::Matrix<double, 5, 3> input = Eigen::Matrix<double, 5, 3>::Zero();
  input(0, 0) = dt;
  input.block<2, 1>(1, 0) = 0.5 * turned * dt * dt;
  input.block<2, 1>(3, 0) = 0.25 * turned * dt * dt * dt;
  input.block<2, 2>(1, 1) = middle * dt;
  input.block<2, 2>(3, 1) = 0.5 * middle * dt * dt;

  // Noise of rate and force over the step.
  const bool saturated = a.is_saturated || b.is_saturated;
  const double gyro = square(saturated ? imu.saturation_gyro_noise : imu.gyro_noise) +
                      square(imu.gyro_scale_sigma * rate);
  const double accelerometer =
      square(saturated ? imu.saturation_force_noise : imu.force_noise) + square(imu.level_noise);
  const Eigen::Vector3d power(gyro, accelerometer, accelerometer);
  sum.covariance = forward * sum.covariance * forward.transpose() +
                   input * (power / dt).asDiagonal() * input.transpose();
  sum.bias_jacobian = forward * sum.bias_jacobian - input;

  sum.position_m += sum.velocity_mps * dt + 0.5 * acceleration * dt * dt;
  sum.velocity_mps += acceleration * dt;
  sum.yaw_rad += rate * dt;
  sum.seconds += dt;
}

/// The lever force is subtracted with the rates at both ends: their noise times the lever is noise
/// of the velocity there; that at the start moves the end's position.
void add_lever_noise(model::Preintegration& sum, const ImuParameters& imu) {
  const double at_end = square(imu.gyro_noise) / kLeverBaseline_s *
                        (square(imu.mount.x_m) + square(imu.mount.y_m) + square(imu.mount.z_m));
  const Eigen::Matrix2d one = at_end * Eigen::Matrix2d::Identity();
  sum.covariance.block<2, 2>(1, 1) += 2.0 * one;
  sum.covariance.block<2, 2>(1, 3) += sum.seconds * one;
  sum.covariance.block<2, 2>(3, 1) += sum.seconds * one;
  sum.covariance.block<2, 2>(3, 3) += square(sum.seconds) * one;
}

/// Speed and yaw rate over one step.
struct DriveStep {
  double seconds = 0.0;
  double speed_mps = 0.0;
  double rate_rad_s = 0.0;
  bool is_saturated = false;
};

/// Motion of the axle's middle over one step. Errors with a correlation time tau, acting for dt <<
/// tau, have the power tau * dt.
geometry::SE2WithCovariance driven(const DriveStep& step, double scale_sigma,
                                   const LidarImuInputParameters& parameters,
                                   const YawRateBias& bias) {
  const WheelNoise& noise = parameters.wheels.noise;
  const double dt = step.seconds;
  const double speed = step.speed_mps;
  const double power = dt * noise.correlation_time_s;
  const double gyro =
      step.is_saturated ? parameters.imu.saturation_gyro_noise : parameters.imu.gyro_noise;
  const double stationary = square(noise.standstill_sigma_m) * dt;

  geometry::SE2WithCovariance increment{geometry::SE2::Exp({speed * dt, 0.0, step.rate_rad_s * dt}),
                                        Eigen::Matrix3d::Zero()};
  increment.covariance(0, 0) = square(speed * scale_sigma) * power + stationary;
  increment.covariance(1, 1) = square(speed * noise.side_slip_sigma) * power + stationary;
  increment.covariance(2, 2) =
      square(gyro) * dt +
      (square(bias.sigma_rad_s) + square(step.rate_rad_s * parameters.imu.gyro_scale_sigma)) *
          power;
  return increment;
}

}  // namespace

LevelSample interpolate(const LevelSample& before, const LevelSample& after, model::Utime utime) {
  if (after.utime == before.utime) return after;
  const double share =
      seconds_between(before.utime, utime) / seconds_between(before.utime, after.utime);
  const auto mix = [share](const auto& a, const auto& b) { return a + share * (b - a); };
  LevelSample sample;
  sample.utime = utime;
  sample.yaw_rate_rad_s = mix(before.yaw_rate_rad_s, after.yaw_rate_rad_s);
  sample.force_mps2 = before.force_mps2 + share * (after.force_mps2 - before.force_mps2);
  sample.pitch_cosine = mix(before.pitch_cosine, after.pitch_cosine);
  sample.is_saturated = before.is_saturated || after.is_saturated;
  return sample;
}

void LevelSamples::forget_before(model::Utime utime) {
  while (samples_.size() > 1 && samples_[1].utime <= utime) samples_.pop_front();
}

std::optional<std::deque<LevelSample>> LevelSamples::between(model::Utime from,
                                                             model::Utime to) const {
  if (samples_.empty() || samples_.front().utime > from || samples_.back().utime < to || to <= from)
    return std::nullopt;

  std::deque<LevelSample> result;
  auto next = std::ranges::upper_bound(samples_, from, {}, &LevelSample::utime);
  const auto gap = [this](const LevelSample& a, const LevelSample& b) {
    return seconds_between(a.utime, b.utime) > max_gap_s_;
  };
  for (auto before = std::prev(next);; before = next++) {
    if (gap(*before, *next)) return std::nullopt;
    if (result.empty()) result.push_back(interpolate(*before, *next, from));
    if (next->utime >= to) {
      result.push_back(interpolate(*before, *next, to));
      return result;
    }
    result.push_back(*next);
  }
}

model::Preintegration preintegrate(const std::deque<LevelSample>& samples, const ImuParameters& imu,
                                   const model::InertialBias& bias) {
  model::Preintegration sum;
  sum.bias = bias;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) step(sum, samples[i], samples[i + 1], imu);
  add_lever_noise(sum, imu);
  return sum;
}

std::optional<geometry::SE2WithCovariance> drive(const std::deque<LevelSample>& samples,
                                                 const WheelSpeeds& speeds,
                                                 const LidarImuInputParameters& parameters,
                                                 const YawRateBias& bias) {
  const model::Utime from = samples.front().utime;
  const model::Utime to = samples.back().utime;
  if (!speeds.cover(from, to)) return std::nullopt;

  // Motion of the axle's middle.
  geometry::SE2WithCovariance motion;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const LevelSample& a = samples[i];
    const LevelSample& b = samples[i + 1];
    const double rate = 0.5 * (a.yaw_rate_rad_s + b.yaw_rate_rad_s) - bias.bias_rad_s;
    const double speed =
        0.5 * (speeds.at(a.utime) + speeds.at(b.utime)) * 0.5 * (a.pitch_cosine + b.pitch_cosine);
    const DriveStep step{seconds_between(a.utime, b.utime), speed, rate,
                         a.is_saturated || b.is_saturated};
    motion = compound(motion, driven(step, speeds.latest().scale_sigma, parameters, bias));
  }

  // Each end of the interval has the stamps' jitter; the gyro's yaw is independent of the wheels.
  Eigen::Vector3d twist = motion.mean.Log() / seconds_between(from, to);
  twist.z() = 0.0;
  motion.covariance +=
      2.0 * square(parameters.wheels.noise.stamp_sigma_s) * twist * twist.transpose();

  // The same motion of frame vehicle.
  const geometry::SE2& axle_T_vehicle = parameters.wheels.car.axle_T_vehicle;
  const geometry::SE2 vehicle_T_axle = axle_T_vehicle.inverse();
  const Eigen::Matrix3d adjoint = vehicle_T_axle.Adjoint();
  return geometry::SE2WithCovariance{vehicle_T_axle * motion.mean * axle_T_vehicle,
                                     adjoint * motion.covariance * adjoint.transpose()};
}

}  // namespace understory::lidar_imu_input
