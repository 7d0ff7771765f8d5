// The IMU's samples in `vehicle_level`, and their integration between two stamps.
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

/// One levelled sample of the IMU: only gravity is subtracted.
struct LevelSample {
  model::Utime utime = 0;
  double yaw_rate_rad_s = 0.0;                           ///< Of the heading.
  Eigen::Vector2d force_mps2 = Eigen::Vector2d::Zero();  ///< Along level x and y.
  double pitch_cosine = 1.0;                             ///< Of the vehicle.
  bool is_saturated = false;                             ///< Samples before it were omitted.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.yaw_rate_rad_s, self.force_mps2, self.pitch_cosine, self.is_saturated);
  }
};

/// The sample at `utime`, interpolated linearly between its neighbours; saturated if either is.
LevelSample interpolate(const LevelSample& before, const LevelSample& after, model::Utime utime);

/// Recent levelled samples, for intervals between two stamps. Invariant: in order of time.
class LevelSamples {
 public:
  /// `max_gap_s`: samples at a larger distance in time are not joined.
  explicit LevelSamples(double max_gap_s) : max_gap_s_(max_gap_s) {}

  /// Precondition: not before the latest one.
  void add(const LevelSample& sample) { samples_.push_back(sample); }
  /// Removes samples that are not needed from `utime` on.
  void forget_before(model::Utime utime);
  /// Samples at `from`, all in between, and at `to`; none if there is a gap or the samples end.
  std::optional<std::deque<LevelSample>> between(model::Utime from, model::Utime to) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.samples_);
  }

 private:
  double max_gap_s_;
  std::deque<LevelSample> samples_;
};

/// Integrates samples (the first at the start, the last at the end of the interval) with the
/// trapezoidal rule. `bias`: subtracted, and the point of the Jacobian. Noise: of the samples, of
/// the level and of the lever.
model::Preintegration preintegrate(const std::deque<LevelSample>& samples, const ImuParameters& imu,
                                   const model::InertialBias& bias);

/// Bias of the gyro's yaw rate, and its uncertainty.
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
/// and last at the interval's ends). None if the speeds do not cover the interval.
std::optional<geometry::SE2WithCovariance> drive(const std::deque<LevelSample>& samples,
                                                 const WheelSpeeds& speeds,
                                                 const LidarImuInputParameters& parameters,
                                                 const YawRateBias& bias);

}  // namespace understory::lidar_imu_input
