// The IMU's samples in `vehicle_level`, and what becomes of them between two stamps.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/parameters.hpp"
#include "services/lidar_imu_input/wheel_speeds.hpp"

namespace understory::lidar_imu_input {

/// One sample of the IMU after levelling: nothing subtracted but gravity.
struct LevelSample {
  model::Utime utime = 0;
  double yaw_rate_rad_s = 0.0;                           ///< Of the heading.
  Eigen::Vector2d force_mps2 = Eigen::Vector2d::Zero();  ///< Along level x and y.
  double pitch_cosine = 1.0;
  bool is_saturated = false;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.yaw_rate_rad_s, self.force_mps2, self.pitch_cosine, self.is_saturated);
  }
};

/// The sample at `utime`, between its two neighbours in proportion to time.
LevelSample interpolate(const LevelSample& before, const LevelSample& after, model::Utime utime);

/// Recent levelled samples, asked for the stretch between two stamps.
class LevelSamples {
 public:
  explicit LevelSamples(double max_gap_s) : max_gap_s_(max_gap_s) {}
  void add(const LevelSample& sample) { samples_.push_back(sample); }
  void clear() { samples_.clear(); }
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
/// trapezoidal rule. Noise: that of the samples and of the level.
model::Preintegration preintegrate(const std::deque<LevelSample>& samples, const ImuParameters& imu,
                                   const model::InertialBias& bias);

/// How well the gyro's bias is known.
struct YawRateBias {
  double bias_rad_s = 0.0;
  double sigma_rad_s = 0.0;
};

/// Motion of the vehicle from the wheels' speed and the gyro's yaw rate over the same samples.
/// `speeds`: covers the interval; the last one holds. None where it does not.
std::optional<geometry::SE2WithCovariance> drive(const std::deque<LevelSample>& samples,
                                                 const WheelSpeeds& speeds,
                                                 const LidarImuInputParameters& parameters,
                                                 const YawRateBias& bias);

}  // namespace understory::lidar_imu_input
