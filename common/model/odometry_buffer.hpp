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
  double gyro_bias_variance = 0.0;                         ///< [(rad/s)^2]

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.velocity_mps, s.covariance, s.gyro_bias_variance);
  }
};

/// The gyro's bias by a filter that uses landmarks.
struct FilterBias {
  double bias = 0.0;      ///< [rad/s]
  double variance = 0.0;  ///< [(rad/s)^2]

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.bias, s.variance);
  }
};

/// The rotation over an interval by the gyro.
struct GyroRotation {
  double rotation_rad = 0.0;
  double variance = 0.0;  ///< Of the rotation [rad^2]; white noise alone, see OdometryBuffer.
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

/// Keeps consecutive increments of odometry: at most 20,000, the oldest are dropped.
class OdometryBuffer {
 public:
  /// Correlation time [s] of the error of the filter's gyro bias.
  static constexpr double kBiasCorrelation_s = 5.0;

  /// `bias_correlation_s`: time over which the error of the filter's gyro bias stays the same, for
  /// covariances of compounded increments. 0: the caller estimates the bias as a variable of its
  /// own, and covariances are those of the new error in each increment.
  explicit OdometryBuffer(double bias_correlation_s = kBiasCorrelation_s)
      : bias_correlation_s_(bias_correlation_s) {}

  /// Adds an increment. One that overlaps the last one or runs backwards is refused (false).
  bool add(const Odometry& increment);
  /// Sets the inertial bias by a filter that uses landmarks: increments with an IMU that are added
  /// later are corrected by the difference to the bias that they were integrated with.
  void set_bias(const InertialBias& bias) { bias_ = bias; }
  /// The bias that was set; none at the start.
  const std::optional<InertialBias>& bias() const { return bias_; }
  /// Sets the filter's bias and velocity. The errors of wheels (radius, slip) are correlated over
  /// seconds; counted as noise of the same power they make the path from scan to scan thirty times
  /// as uncertain as it is. A filter has estimated them: increments with an IMU start at its
  /// velocity, where that is more certain.
  void set_filter_pose(const EkfPose& pose);
  /// The filter's velocity at the end of the last increment; none before the first filter pose and
  /// after a gap.
  const std::optional<VelocityEstimate>& velocity() const { return velocity_; }
  /// The filter's gyro bias; none where there is no velocity().
  std::optional<FilterBias> filter_bias() const {
    if (!bias_ || !velocity_ || !(velocity_->gyro_bias_variance > 0.0)) return std::nullopt;
    return FilterBias{bias_->x(), velocity_->gyro_bias_variance};
  }
  /// Motion of the vehicle (from_T_to), or none where a gap or the end of the buffer is in between.
  /// Inside an increment the twist is constant and the covariance in proportion to time. Cost: the
  /// increments in between, and a binary search.
  std::optional<geometry::SE2WithCovariance> between(Utime from, Utime to) const;
  /// The rotation alone by the gyro; none also where there was no IMU.
  std::optional<GyroRotation> gyro_rotation(Utime from, Utime to) const;
  /// Drops the increments that end at `utime` or before.
  void forget_before(Utime utime);
  /// The increments in order of time, as they were corrected.
  const std::deque<Odometry>& increments() const { return increments_; }
  /// Members of a saved state (include common/model/archive.hpp); see common/state. The correlation
  /// time is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.increments_, self.bias_, self.velocity_);
  }

 private:
  void start_at_velocity(Odometry& increment);

  double bias_correlation_s_;
  std::deque<Odometry> increments_;
  std::optional<InertialBias> bias_;
  std::optional<VelocityEstimate>
      velocity_;  ///< At the end of the last increment that continued it.
};

}  // namespace understory::model
