#include "services/lidar_imu_input/stationary_monitor.hpp"

#include <Eigen/LU>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kBiasKnown_s = 3.0;    // of standstill
constexpr double kStillSigmas = 4.0;    // largest apparent velocity of a stationary vehicle
constexpr double kCorrected_s = 2.0;    // validity of the filter's corrections
constexpr double kInsistence_s = 10.0;  // then an uncorrected velocity is taken as wrong

}  // namespace

VelocityEvidence VelocityEvidence::of(const DeadReckoning& reckoning, bool wheels_are_fresh,
                                      model::Utime corrected_utime) {
  return {reckoning.velocity(), reckoning.velocity_covariance(), wheels_are_fresh, corrected_utime};
}

StationaryMonitor::StationaryMonitor(const StandstillParameters& standstill,
                                     const ImuParameters& imu)
    : parameters_(standstill),
      gyro_bias_walk_(imu.gyro_bias_walk),
      detector_(standstill),
      bias_{0.0, imu.gyro_bias_sigma} {}

void StationaryMonitor::begin_at(model::Utime utime) {
  detector_.reset();
  moved_utime_ = utime;
}

void StationaryMonitor::add(const model::ImuSample& sample, double seconds,
                            const Eigen::Vector3d& gyro_bias, const VelocityEvidence& velocity) {
  bias_.sigma_rad_s = std::sqrt(square(bias_.sigma_rad_s) + square(gyro_bias_walk_) * seconds);

  const bool bias_known = detector_.longest_s() > kBiasKnown_s &&
                          bias_.sigma_rad_s < 0.02 * parameters_.gyro_mean_rad_s;
  detector_.add(sample, bias_known ? std::optional(gyro_bias) : std::nullopt,
                allows_stationary(sample.utime, velocity));

  if (!is_stationary()) moved_utime_ = sample.utime;
}

void StationaryMonitor::learn_bias(const AttitudeFilter& attitude) {
  const Eigen::Vector3d down = attitude.level_Q_vehicle().conjugate() * Eigen::Vector3d::UnitZ();
  bias_.bias_rad_s = down.dot(attitude.gyro_bias());
  bias_.sigma_rad_s = std::sqrt(down.dot(attitude.gyro_bias_covariance() * down));
}

/// Without wheels only quiet samples indicate a standstill. Then the velocity, corrected by the
/// filter's landmarks, must agree.
bool StationaryMonitor::allows_stationary(model::Utime now, const VelocityEvidence& velocity) {
  const double slow = parameters_.wheel_speed_mps;
  const Eigen::Matrix2d spread =
      velocity.covariance_m2ps2 + square(slow) * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d& v = velocity.velocity_mps;
  const bool agrees = v.dot(spread.inverse() * v) <= square(kStillSigmas);
  if (agrees || velocity.wheels_are_fresh) {
    denied_since_.reset();
    return true;
  }

  denied_since_ = denied_since_.value_or(now);
  return seconds_between(velocity.corrected_utime, now) > kCorrected_s &&
         seconds_between(*denied_since_, now) > kInsistence_s;
}

}  // namespace understory::lidar_imu_input
