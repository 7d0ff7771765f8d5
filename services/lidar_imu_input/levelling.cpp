#include "services/lidar_imu_input/levelling.hpp"

#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// The motion that is noticed last began later than twice this before.
constexpr double kBetweenRests_s = 0.2;

}  // namespace

void Levelling::begin(const model::ImuSample& sample) {
  attitude_.emplace(imu_, sample.specific_force_mps2);
  set_latest(sample, level(sample, false));
}

void Levelling::bridge(double seconds) {
  rests_.clear();
  attitude_->bridge(seconds);
}

void Levelling::propagate(const model::ImuSample& sample, bool is_saturated, double seconds) {
  attitude_->propagate(0.5 * (latest_->angular_rate_rad_s + sample.angular_rate_rad_s),
                       0.5 * (latest_->specific_force_mps2 + sample.specific_force_mps2), seconds,
                       is_saturated);
}

void Levelling::keep_rest(model::Utime utime) {
  if (!rests_.empty() && seconds_between(rests_.back().utime, utime) < kBetweenRests_s) return;
  rests_.push_back({utime, *attitude_});
  if (rests_.size() > kRests) rests_.pop_front();
}

void Levelling::start_moving(const std::deque<model::ImuSample>& samples) {
  if (rests_.empty()) return;
  const Rest rest = rests_.front();
  rests_.clear();
  attitude_ = rest.attitude;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const model::ImuSample& from = samples[i - 1];
    const model::ImuSample& to = samples[i];
    if (to.utime <= rest.utime) continue;
    attitude_->propagate(0.5 * (from.angular_rate_rad_s + to.angular_rate_rad_s),
                         0.5 * (from.specific_force_mps2 + to.specific_force_mps2),
                         seconds_between(from.utime, to.utime), false);
  }
  attitude_->mark_level();
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
