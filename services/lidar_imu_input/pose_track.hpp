// Pose of the vehicle by dead reckoning, now and during the last seconds.
#pragma once

#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/imu.hpp"
#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/dead_reckoning.hpp"
#include "services/lidar_imu_input/motion_history.hpp"

namespace understory::lidar_imu_input {

/// Owns the dead reckoning with its stamp, the height, and their history. The pose is in `odom`.
class PoseTrack {
 public:
  /// `imu`: noise and priors of the dead reckoning.
  explicit PoseTrack(const ImuParameters& imu) : reckoning_(imu) {}

  /// From one levelled sample to the next, `seconds` later. `climb_mps`: vertical velocity.
  void propagate(const LevelSample& from, const LevelSample& to, double climb_mps, double seconds);
  /// Bridges the time up to `utime` without sensors: velocity and `yaw_rate_rad_s` stay constant.
  void bridge_gap(model::Utime utime, double yaw_rate_rad_s);
  /// Follows odometry from the wheels alone, as far as the IMU has not moved the pose.
  void follow_wheels(const model::Odometry& odometry);
  /// The IMU has moved the pose up to `utime`.
  void reach(model::Utime utime);
  /// The motion at the latest IMU sample (frame vehicle).
  MotionState state_at(const model::ImuSample& sample, const AttitudeFilter& attitude) const;
  /// Adds the motion at an IMU sample (frame vehicle) to the history.
  void remember(const model::ImuSample& sample, const AttitudeFilter& attitude);

  /// For updates with measurements.
  DeadReckoning& reckoning() { return reckoning_; }
  /// Present pose, velocity and biases.
  const DeadReckoning& reckoning() const { return reckoning_; }
  /// Motion during the last seconds.
  const MotionHistory& history() const { return history_; }
  /// RAW_POSE. `is_reference`: corrected by GNSS, not for mapping.
  model::RawPose raw_pose(bool is_reference) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.reckoning_, self.history_, self.utime_, self.height_m_);
  }

 private:
  DeadReckoning reckoning_;
  MotionHistory history_;
  std::optional<model::Utime> utime_;  ///< Of the pose.
  double height_m_ = 0.0;              ///< Above the start; drifts.
};

}  // namespace understory::lidar_imu_input
