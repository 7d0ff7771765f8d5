#include "services/lidar_imu_input/velocity_corrections.hpp"

#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {

bool VelocityCorrections::add(const model::VelocityCorrection& correction,
                              std::optional<model::Utime> latest) {
  waiting_.push_back(correction);
  return !latest || *latest < correction.utime + delay_us_;
}

std::optional<model::VelocityCorrection> VelocityCorrections::take_due(model::Utime now) {
  if (waiting_.empty() || waiting_.front().utime + delay_us_ > now) return std::nullopt;
  const model::VelocityCorrection correction = waiting_.front();
  waiting_.pop_front();
  return correction;
}

void VelocityCorrections::set_applied(model::Utime now, const Eigen::Vector2d& odom_change_mps) {
  applied_utime_ = now;
  changes_.push_back({now, odom_change_mps});
  while (seconds_between(changes_.front().utime, now) > MotionHistory::kKept_s)
    changes_.pop_front();
}

Eigen::Vector2d VelocityCorrections::change_since(model::Utime utime) const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (auto one = changes_.rbegin(); one != changes_.rend() && one->utime > utime; ++one)
    sum += one->odom_mps;
  return sum;
}

}  // namespace understory::lidar_imu_input
