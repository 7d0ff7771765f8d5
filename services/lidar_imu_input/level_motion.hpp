// The IMU's samples in `vehicle_level`, and what becomes of them between two stamps.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>
#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/parameters.hpp"
#include "services/lidar_imu_input/wheel_speeds.hpp"

namespace understory::lidar_imu_input {

/// Rotation of the plan by an angle [rad], 2x2.
inline Eigen::Matrix2d planar_rotation(double angle_rad) {
  return Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
}

/// One sample of the IMU after levelling: nothing is subtracted but gravity.
struct LevelSample {
  model::Utime utime = 0;
  double yaw_rate_rad_s = 0.0;                           ///< Of the heading.
  Eigen::Vector2d force_mps2 = Eigen::Vector2d::Zero();  ///< Along level x and y.
  double pitch_cosine = 1.0;                             ///< Of the vehicle.
  bool is_saturated = false;                             ///< Samples before it were left out.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.yaw_rate_rad_s, self.force_mps2, self.pitch_cosine, self.is_saturated);
  }
};

/// The sample at `utime`, between its two neighbours in proportion to time; saturated where either
/// is.
LevelSample interpolate(const LevelSample& before, const LevelSample& after, model::Utime utime);

/// Recent levelled samples, asked for the interval between two stamps. Invariant: in order of time.
class LevelSamples {
 public:
  /// `max_gap_s`: samples farther apart are not joined.
  explicit LevelSamples(double max_gap_s) : max_gap_s_(max_gap_s) {}

  /// Precondition: not before the latest one.
  void add(const LevelSample& sample) { samples_.push_back(sample); }
  /// Keeps what is needed from `utime` on.
  void forget_before(model::Utime utime);
  /// Samples at `from`, all in between, and at `to`; none where a gap or an end is in between.
  std::optional<std::deque<LevelSample>> between(model::Utime from, model::Utime to) const;

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.samples_);
  }

 private:
  double max_gap_s_;
  std::deque<LevelSample> samples_;
};

/// Integrates samples (the first at the start, the last at the end of the interval) with the
/// trapezoidal rule. `bias`: taken out, and what the Jacobian is about. Noise: that of the samples,
/// of the level and of the lever.
model::Preintegration preintegrate(const std::deque<LevelSample>& samples, const ImuParameters& imu,
                                   const model::InertialBias& bias);

/// Bias of the gyro's yaw rate, and how well it is known.
struct YawRateBias {
  double bias_rad_s = 0.0;
  double sigma_rad_s = 0.0;

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.bias_rad_s, self.sigma_rad_s);
  }
};

/// Motion of frame `vehicle` from the wheels' speed and the gyro's yaw rate over the samples (first
/// and last at the interval's ends). None where the speeds do not cover the interval.
std::optional<geometry::SE2WithCovariance> drive(const std::deque<LevelSample>& samples,
                                                 const WheelSpeeds& speeds,
                                                 const LidarImuInputParameters& parameters,
                                                 const YawRateBias& bias);

}  // namespace understory::lidar_imu_input
