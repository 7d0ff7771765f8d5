#include "services/lidar_imu_input/levelling.hpp"

#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// Largest delay of the detection of motion.
constexpr double kBetweenRests_s = 0.2;

}  // namespace

void Levelling::begin(const model::ImuSample& sample) {
  attitude_.emplace(imu_, sample.specific_force_mps2);
  set_latest(sample, level(sample, false));
}

void Levelling::bridge(double seconds) {
  rests_.clear();
  since_rest_.clear();
  attitude_->bridge(seconds);
}

void Levelling::propagate(const model::ImuSample& sample, bool is_saturated, double seconds) {
  propagate(*latest_, sample, is_saturated, seconds);
  if (!rests_.empty()) since_rest_.push_back({sample, is_saturated});
}

void Levelling::propagate(const model::ImuSample& from, const model::ImuSample& to,
                          bool is_saturated, double seconds) {
  attitude_->propagate(0.5 * (from.angular_rate_rad_s + to.angular_rate_rad_s),
                       0.5 * (from.specific_force_mps2 + to.specific_force_mps2), seconds,
                       is_saturated);
}

void Levelling::keep_rest(const model::ImuSample& sample) {
  if (!rests_.empty() && seconds_between(rests_.back().utime, sample.utime) < kBetweenRests_s)
    return;
  rests_.push_back({sample.utime, *attitude_});
  if (since_rest_.empty()) since_rest_.push_back({sample, false});
  if (rests_.size() <= kRests) return;

  rests_.pop_front();
  while (!since_rest_.empty() && since_rest_.front().sample.utime < rests_.front().utime)
    since_rest_.pop_front();
}

std::optional<model::Utime> Levelling::start_moving() {
  if (rests_.empty()) return std::nullopt;
  const model::Utime utime = rests_.front().utime;
  attitude_ = rests_.front().attitude;
  for (std::size_t i = 1; i < since_rest_.size(); ++i) {
    const model::ImuSample& before = since_rest_[i - 1].sample;
    const auto& [sample, is_saturated] = since_rest_[i];
    propagate(before, sample, is_saturated, seconds_between(before.utime, sample.utime));
  }
  attitude_->mark_level();
  rests_.clear();
  since_rest_.clear();
  return utime;
}

LevelSample Levelling::level(const model::ImuSample& sample, bool is_saturated) const {
  const Eigen::Quaterniond level_Q_vehicle = attitude_->level_Q_vehicle();
  const RollPitchYaw angles = roll_pitch_yaw(level_Q_vehicle);
  const Eigen::Vector3d& bias = attitude_->gyro_bias();
  const Eigen::Vector3d& rate = sample.angular_rate_rad_s;

  LevelSample result;
  result.utime = sample.utime;
  // Rate of the heading; the bias about z is not subtracted: see `InertialBias`.
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
