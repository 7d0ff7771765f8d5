#include "services/lidar_imu_input/velocity_corrections.hpp"

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

}  // namespace understory::lidar_imu_input
