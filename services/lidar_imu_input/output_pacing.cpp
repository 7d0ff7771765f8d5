#include "services/lidar_imu_input/output_pacing.hpp"

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {

RawPosePacer::RawPosePacer(double period_s) : period_us_(microseconds(period_s)) {}

std::optional<model::RawPose> RawPosePacer::take(const model::RawPose& pose, bool at_once) {
  if (last_utime_ && pose.utime <= *last_utime_) return std::nullopt;
  if (!at_once && last_utime_ && pose.utime - *last_utime_ < period_us_) return std::nullopt;
  last_utime_ = pose.utime;
  return pose;
}

std::optional<InputFault> CalibrationWatch::check(const MotionEstimator& motion, bool imu_is_live) {
  if (is_reported_ || motion.is_calibrated()) return std::nullopt;

  // In the first second nothing is known yet.
  const MotionHistory& history = motion.history();
  const bool moves = !motion.is_stationary() &&
                     history.newest().utime - history.oldest().utime > microseconds(1.0) &&
                     imu_is_live;
  if (!moves) return std::nullopt;

  is_reported_ = true;
  return InputFault{InputFaultKind::kNotCalibrated, channel_of(Sensor::kImu),
                    "the vehicle moves before it has been stationary long enough"};
}

}  // namespace understory::lidar_imu_input
