#include "services/lidar_imu_input/levelling.hpp"

#include <cmath>

namespace understory::lidar_imu_input {

void Levelling::begin(const model::ImuSample& sample) {
  attitude_.emplace(imu_, sample.specific_force_mps2);
  set_latest(sample, level(sample, false));
}

void Levelling::propagate(const model::ImuSample& sample, bool is_saturated, double seconds) {
  attitude_->propagate(0.5 * (latest_->angular_rate_rad_s + sample.angular_rate_rad_s),
                       0.5 * (latest_->specific_force_mps2 + sample.specific_force_mps2), seconds,
                       is_saturated);
}

LevelSample Levelling::level(const model::ImuSample& sample, bool is_saturated) const {
  const Eigen::Quaterniond level_Q_vehicle = attitude_->level_Q_vehicle();
  const RollPitchYaw angles = roll_pitch_yaw(level_Q_vehicle);
  const Eigen::Vector3d& bias = attitude_->gyro_bias();
  const Eigen::Vector3d& rate = sample.angular_rate_rad_s;

  LevelSample result;
  result.utime = sample.utime;
  // Rate of the heading; the bias about z stays in, for `InertialBias`.
  result.yaw_rate_rad_s =
      (std::sin(angles.roll_rad) * (rate.y() - bias.y()) + std::cos(angles.roll_rad) * rate.z()) /
      std::cos(angles.pitch_rad);
  result.force_mps2 = (level_Q_vehicle * sample.specific_force_mps2).head<2>();
  result.pitch_cosine = std::cos(angles.pitch_rad);
  result.is_saturated = is_saturated;
  return result;
}

void Levelling::set_latest(const model::ImuSample& sample, const LevelSample& level) {
  latest_ = sample;
  latest_level_ = level;
}

}  // namespace understory::lidar_imu_input
