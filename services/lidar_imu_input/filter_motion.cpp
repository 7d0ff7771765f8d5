#include "services/lidar_imu_input/filter_motion.hpp"

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::uint32_t kFewLandmarks = 3;

}  // namespace

void FilterMotion::add(const model::EkfPose& pose) {
  const geometry::SE2& at = pose.ekf_map_T_vehicle;
  // A filter without landmarks only predicts.
  if (!at.coordinates().allFinite() || pose.landmarks_used < kFewLandmarks) return;

  const bool begins =
      pose.reset_counter != reset_counter_ ||
      (!poses_.empty() && pose.utime <= poses_.back().utime) ||
      (!poses_.empty() && seconds_between(poses_.back().utime, pose.utime) > kLongest_s);
  if (begins) poses_.clear();
  reset_counter_ = pose.reset_counter;
  poses_.push_back({pose.utime, at.x(), at.y(), at.theta()});
  // One pose as old as the baseline is kept.
  while (poses_.size() > 2 && seconds_between(poses_[1].utime, pose.utime) >= kBaseline_s)
    poses_.pop_front();
}

std::optional<MotionState> FilterMotion::at(model::Utime stamp) const {
  if (poses_.size() < 2) return std::nullopt;

  const Pose& first = poses_.front();
  const Pose& last = poses_.back();
  const double ago_s = seconds_between(last.utime, stamp);
  const double seconds = seconds_between(first.utime, last.utime);
  if (ago_s < 0.0 || ago_s > kLongest_s || seconds < 0.5 * kBaseline_s) return std::nullopt;

  const geometry::SE2 moved = geometry::SE2(first.x_m, first.y_m, first.heading_rad).inverse() *
                              geometry::SE2(last.x_m, last.y_m, last.heading_rad);
  const Eigen::Vector3d twist = moved.Log() / seconds;
  MotionState state;
  state.utime = stamp;
  state.velocity_mps << twist.x(), twist.y(), 0.0;
  state.rate_rad_s << 0.0, 0.0, twist.z();
  return state;
}

}  // namespace understory::lidar_imu_input
