// Recent odometry: the motion between any two stamps.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"

namespace understory::model {

/// The vehicle's velocity from a filter that uses landmarks.
struct VelocityEstimate {
  Utime utime = 0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level` at utime.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();    ///< [(m/s)^2]
  InertialBias bias = InertialBias::Zero();  ///< Only the accelerometer's part is used.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.velocity_mps, s.covariance, s.bias);
  }
};

/// The gyro's rotation over an interval.
struct GyroRotation {
  double rotation_rad = 0.0;
  double variance = 0.0;  ///< Variance of the rotation [rad^2] from the gyro's white noise alone.
  double seconds = 0.0;   ///< Time in motion.
  double bias_rad = 0.0;  ///< Rotation that was subtracted as the gyro's bias.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.rotation_rad, s.variance, s.seconds, s.bias_rad);
  }

  /// Appends the following interval.
  void operator+=(const GyroRotation& other) {
    rotation_rad += other.rotation_rad;
    variance += other.variance;
    seconds += other.seconds;
    bias_rad += other.bias_rad;
  }
};

/// The motion measured by the IMU alone between two stamps.
struct InertialMotion {
  Preintegration inertial;
  bool is_stationary = false;  ///< The vehicle was stationary during the whole interval.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.inertial, s.is_stationary);
  }
};

/// Stores consecutive increments of odometry, at most 20,000; the oldest are dropped. Increments
/// without wheels may start at a filter's velocity.
class OdometryBuffer {
 public:
  /// Adds an increment. One that overlaps the last one or runs backwards is refused (false).
  bool add(const Odometry& increment);
  /// Without wheels, the translation of odometry is from dead reckoning. Later increments with an
  /// IMU but without wheels start at the filter's velocity where this is more certain; its variance
  /// is multiplied by kInflation, because the filter used the same detections as the caller. Wheels
  /// and rotations are never changed.
  void set_filter_velocity(const EkfPose& pose);
  /// Factor on the variance of the filter's velocity.
  static constexpr double kInflation = 4.0;
  /// Motion of the vehicle (from_T_to), or none where a gap or the end of the buffer lies between.
  /// Inside an increment the twist is constant and the covariance proportional to time. Cost: the
  /// increments between, and a binary search.
  std::optional<geometry::SE2WithCovariance> between(Utime from, Utime to) const;
  /// The rotation from the gyro alone; none also without an IMU.
  std::optional<GyroRotation> gyro_rotation(Utime from, Utime to) const;
  /// The motion from the IMU alone. None where a stamp is not the end of an increment, across a
  /// gap, and without an IMU.
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
  std::optional<VelocityEstimate> velocity_;  ///< Velocity at the end of the last increment.
};

}  // namespace understory::model
