// Recent odometry: the motion between any two stamps.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"

namespace understory::model {

/// The vehicle's velocity by a filter that uses landmarks.
struct VelocityEstimate {
  Utime utime = 0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level` at utime.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();    ///< [(m/s)^2]
  InertialBias bias = InertialBias::Zero();  ///< Of it the accelerometer's part is used.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.velocity_mps, s.covariance, s.bias);
  }
};

/// The rotation over an interval by the gyro.
struct GyroRotation {
  double rotation_rad = 0.0;
  double variance = 0.0;  ///< Of the rotation [rad^2]: the gyro's white noise alone.
  double seconds = 0.0;   ///< Time in motion.
  double bias_rad = 0.0;  ///< Rotation that was subtracted as the gyro's bias.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.rotation_rad, s.variance, s.seconds, s.bias_rad);
  }

  /// Appends the interval that follows.
  void operator+=(const GyroRotation& other) {
    rotation_rad += other.rotation_rad;
    variance += other.variance;
    seconds += other.seconds;
    bias_rad += other.bias_rad;
  }
};

/// What the IMU alone measured between two stamps.
struct InertialMotion {
  Preintegration inertial;
  bool is_stationary = false;  ///< The vehicle did not move at any time of it.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.inertial, s.is_stationary);
  }
};

/// Keeps consecutive increments of odometry as they came, at most 20,000; the oldest are dropped.
/// Those without wheels may start at a filter's velocity.
class OdometryBuffer {
 public:
  /// Adds an increment. One that overlaps the last one or runs backwards is refused (false).
  bool add(const Odometry& increment);
  /// Without wheels the translation of odometry rests on dead reckoning. Increments that are added
  /// later and have an IMU but no wheels start at the filter's velocity where that is more certain;
  /// it counts with kInflation times its variance, since the filter used the same detections as who
  /// asks. Wheels and rotations are never touched.
  void set_filter_velocity(const EkfPose& pose);
  /// Of the variance of the filter's velocity.
  static constexpr double kInflation = 4.0;
  /// Motion of the vehicle (from_T_to), or none where a gap or the end of the buffer is in between.
  /// Inside an increment the twist is constant and the covariance in proportion to time. Cost: the
  /// increments in between, and a binary search.
  std::optional<geometry::SE2WithCovariance> between(Utime from, Utime to) const;
  /// The rotation alone by the gyro; none also where there was no IMU.
  std::optional<GyroRotation> gyro_rotation(Utime from, Utime to) const;
  /// The motion alone by the IMU. None where a stamp is not the end of an increment, across a gap,
  /// and where there was no IMU.
  std::optional<InertialMotion> inertial(Utime from, Utime to) const;
  /// Drops the increments that end at `utime` or before.
  void forget_before(Utime utime);
  /// The increments in order of time.
  const std::deque<Odometry>& increments() const { return increments_; }
  /// Members of a saved state (include common/model/archive.hpp); see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.increments_, self.velocity_);
  }

 private:
  void start_at_velocity(Odometry& increment);

  std::deque<Odometry> increments_;
  std::optional<VelocityEstimate> velocity_;  ///< At the end of the last increment.
};

}  // namespace understory::model
