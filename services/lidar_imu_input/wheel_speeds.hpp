// Speeds of the rear axle, from the wheels.
#pragma once

#include <deque>
#include <optional>

#include "common/model/wheels.hpp"
#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::lidar_imu_input {

/// Speed of the rear axle's middle along the vehicle's x axis.
struct SpeedSample {
  model::Utime utime = 0;
  double speed_mps = 0.0;
  double scale_sigma = 0.0;  ///< Of the speed, relative.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.speed_mps, self.scale_sigma);
  }
};

/// Scale error of the wheels, estimated from IMU and wheels together.
struct WheelScale {
  double measured_over_true = 1.0;
  double sigma = 0.0;
};

/// The speeds of the last 5 s, corrected by the wheels' scale. Invariant: in order of time.
class WheelSpeeds {
 public:
  /// `wheels`: noise, and validity of a sample.
  explicit WheelSpeeds(const WheelOdometryParameters& wheels) : wheels_(wheels) {}

  /// The axle's speed from the wheels' measurement [m/s], corrected by the scale if that is known.
  /// Its sigma is at most that of the wheels' own noise.
  SpeedSample corrected(model::Utime utime, double measured_mps,
                        const std::optional<WheelScale>& scale) const;
  /// Adds a corrected speed. Precondition: not before the latest one.
  void add(const SpeedSample& speed);

  /// Whether the latest sample is still valid at `now`.
  bool are_fresh(model::Utime now) const;
  /// Whether samples without a gap cover the interval.
  bool cover(model::Utime from, model::Utime to) const;
  /// Speed at `utime` [m/s], interpolated linearly; constant beyond the first and the last one.
  /// Precondition: not empty.
  double at(model::Utime utime) const;
  /// Precondition: not empty.
  const SpeedSample& latest() const { return speeds_.back(); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.speeds_);
  }

 private:
  WheelOdometryParameters wheels_;
  std::deque<SpeedSample> speeds_;
};

}  // namespace understory::lidar_imu_input
