// Pose and velocity of the last seconds, for points and messages of the past.
#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::lidar_imu_input {

/// Pose and velocity at one time.
struct MotionState {
  model::Utime utime = 0;
  Eigen::Quaterniond odom_Q_vehicle = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();    ///< In `odom`; z drifts.
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();  ///< Frame vehicle, without landmarks.
  Eigen::Vector2d level_velocity_mps = Eigen::Vector2d::Zero();  ///< Of the dead reckoning.
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();       ///< Frame vehicle, bias subtracted.
  double heading_rad = 0.0;                                   ///< In `odom`.
  Eigen::Matrix2d tilt_covariance = Eigen::Matrix2d::Zero();  ///< Of (roll, pitch) [rad^2].

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.odom_Q_vehicle, self.position_m, self.velocity_mps, self.level_velocity_mps,
      self.rate_rad_s, self.heading_rad, self.tilt_covariance);
  }
};

/// States of the last `kKept_s`. Invariant: in order of time.
class MotionHistory {
 public:
  /// Precondition: after the newest one.
  void add(const MotionState& state);
  bool empty() const { return states_.empty(); }
  const MotionState& newest() const { return states_.back(); }   ///< Precondition: not empty.
  const MotionState& oldest() const { return states_.front(); }  ///< Precondition: not empty.
  /// The motion at a time: interpolated linearly between two states; after the last one
  /// extrapolated at its velocity and rate; before the first one with the motion shortly after it.
  /// Extrapolates by at most `kMostExtrapolation_s`. None if empty or outside that.
  std::optional<MotionState> at(model::Utime utime) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.states_);
  }

  static constexpr double kMostExtrapolation_s = 0.5;  ///< Beyond the first or the last state.
  static constexpr double kKept_s = 4.0;               ///< Older states are removed.

 private:
  MotionState before_first(model::Utime utime) const;

  std::deque<MotionState> states_;
};

}  // namespace understory::lidar_imu_input
