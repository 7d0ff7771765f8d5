// Recent odometry, asked for the motion between any two stamps.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"

namespace understory::model {

/// How fast the vehicle is, from a filter that sees landmarks.
struct VelocityEstimate {
  Utime utime = 0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level` at utime.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double gyro_bias_variance = 0.0;  ///< [(rad/s)^2]

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.velocity_mps, s.covariance, s.gyro_bias_variance);
  }
};

/// The gyro's bias as a filter knows it [rad/s], [(rad/s)^2].
struct FilterBias {
  double bias = 0.0;
  double variance = 0.0;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.bias, s.variance);
  }
};

/// What a gyro said of a time.
struct GyroRotation {
  double rotation_rad = 0.0;
  double variance = 0.0;  ///< Of that [rad^2]; of white noise alone, see OdometryBuffer.
  double seconds = 0.0;   ///< On the move.
  double bias_rad = 0.0;  ///< What was taken out as the gyro's bias in that time.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.rotation_rad, s.variance, s.seconds, s.bias_rad);
  }

  void operator+=(const GyroRotation& other) {
    rotation_rad += other.rotation_rad;
    variance += other.variance;
    seconds += other.seconds;
    bias_rad += other.bias_rad;
  }
};

/// Keeps consecutive pieces of odometry. Bounded: old pieces are forgotten.
class OdometryBuffer {
 public:
  static constexpr double kBiasCorrelation_s = 5.0;

  /// `bias_lasts_s`: for how long what the filter does not know of the gyro's bias stays the same,
  /// as far as it counts to whoever compounds pieces. 0: they have it as a variable of their own,
  /// covariances are of what is new in each piece.
  explicit OdometryBuffer(double bias_correlation_s = kBiasCorrelation_s)
      : bias_correlation_s_(bias_correlation_s) {}

  /// Adds a piece; one that overlaps or runs backwards is refused (false).
  bool add(const Odometry& increment);
  /// What is known from now on of the gyro's bias (from a filter that sees landmarks): pieces with
  /// an IMU that are added later turn by as much as their own bias differed from it.
  void set_bias(const InertialBias& bias) { bias_ = bias; }
  const std::optional<InertialBias>& bias() const { return bias_; }
  /// The filter's bias and velocity. What wheels do not know (their radius, slip) lasts for
  /// seconds; counted as noise of the same power it makes the way from scan to scan thirty times as
  /// uncertain as it is. A filter has learned it: pieces with an IMU start at its velocity, where
  /// that is surer.
  void set_filter_pose(const EkfPose& pose);
  const std::optional<VelocityEstimate>& velocity() const { return velocity_; }
  /// None before the filter spoke, and after a gap.
  std::optional<FilterBias> filter_bias() const {
    if (!bias_ || !velocity_ || !(velocity_->gyro_bias_variance > 0.0)) return std::nullopt;
    return FilterBias{bias_->x(), velocity_->gyro_bias_variance};
  }
  void restore(const VelocityEstimate& velocity) { velocity_ = velocity; }
  /// Motion of the vehicle from `from` to `to`, or none where a gap or the end of the buffer is in
  /// between. Inside a piece the motion is taken at constant twist and its covariance in proportion
  /// to time.
  std::optional<geometry::SE2WithCovariance> between(Utime from, Utime to) const;
  /// The same of the turn alone; none also where there was no IMU.
  std::optional<GyroRotation> gyro_rotation(Utime from, Utime to) const;
  void forget_before(Utime utime);
  const std::deque<Odometry>& increments() const { return increments_; }
  /// A piece that pieces() gave, into an empty buffer: as it is.
  void restore(const Odometry& increment) { increments_.push_back(increment); }
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
  std::optional<VelocityEstimate> velocity_;  ///< At the end of the last piece that continued it.
};

}  // namespace understory::model
