#include "services/lidar_imu_input/lever_compensation.hpp"

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {

model::ImuSample LeverCompensation::to_vehicle(const model::ImuSample& sensor_sample) {
  const Eigen::Quaterniond rotation = imu_.mount.rotation();
  model::ImuSample sample = sensor_sample;
  sample.angular_rate_rad_s = rotation * sensor_sample.angular_rate_rad_s;
  sample.specific_force_mps2 = rotation * sensor_sample.specific_force_mps2;

  // Centripetal force.
  const Eigen::Vector3d lever = imu_.mount.position_m();
  const Eigen::Vector3d& rate = sample.angular_rate_rad_s;
  Eigen::Vector3d lever_force = rate.cross(rate.cross(lever));

  // Keeps the samples of the baseline; starts anew after a gap.
  if (!raw_.empty() && seconds_between(raw_.back().utime, sample.utime) > imu_.max_gap_s)
    raw_.clear();
  raw_.push_back(sample);
  while (raw_.size() > 2 && seconds_between(raw_[1].utime, sample.utime) >= kLeverBaseline_s)
    raw_.pop_front();

  // Tangential force. Differences of the rate telescope in the integral, so their noise does not
  // accumulate; over several samples it is smaller.
  const double seconds = seconds_between(raw_.front().utime, sample.utime);
  if (seconds > 0.0) lever_force += (rate - raw_.front().angular_rate_rad_s).cross(lever) / seconds;

  sample.specific_force_mps2 -= lever_force;
  return sample;
}

}  // namespace understory::lidar_imu_input
