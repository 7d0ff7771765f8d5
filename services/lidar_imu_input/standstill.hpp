// Detects standstills from the sensors.
#pragma once

#include <deque>
#include <optional>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Examines a short window of IMU samples (and the wheels, if there are any). During the first
/// standstill it estimates the noise of this IMU on this vehicle at rest, and later uses that as a
/// limit.
class StandstillDetector {
 public:
  /// Limits of a quiet window.
  explicit StandstillDetector(const StandstillParameters& parameters) : parameters_(parameters) {}

  /// Adds a sample in frame vehicle. `gyro_bias` [rad/s]: none before it is known.
  /// `may_be_stationary`: false if the known velocity excludes it.
  void add(const model::ImuSample& sample, const std::optional<Eigen::Vector3d>& gyro_bias,
           bool may_be_stationary = true);
  /// Adds the speed of the wheels [m/s]: turning wheels exclude a standstill for `window_s`.
  void add_wheel_speed(model::Utime utime, double speed_mps);
  void reset();  ///< Clears the window, after a gap.

  /// At the latest sample.
  bool is_stationary() const { return is_stationary_; }
  /// Duration without a break, up to the latest sample [s]; 0 while the vehicle moves.
  double stationary_s() const;
  /// Length of the longest standstill so far [s].
  double longest_s() const { return longest_s_; }
  /// Whether there was a standstill of at least `calibration_s`.
  bool is_calibrated() const { return longest_s_ >= parameters_.calibration_s; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.window_, self.is_stationary_, self.since_, self.longest_s_, self.wheels_turned_,
      self.has_turned_, self.gyro_floor_, self.force_floor_, self.floor_windows_);
  }

 private:
  bool is_quiet(const std::optional<Eigen::Vector3d>& gyro_bias);
  bool wheels_turn(model::Utime now) const;

  StandstillParameters parameters_;
  std::deque<model::ImuSample> window_;
  bool is_stationary_ = false;
  model::Utime since_ = 0;  ///< Start of the present standstill.
  double longest_s_ = 0.0;
  model::Utime wheels_turned_ = 0;  ///< Time at which the wheels last turned.
  bool has_turned_ = false;
  double gyro_floor_ = 0.0;   ///< Mean spread at rest [rad/s]; 0 = unknown.
  double force_floor_ = 0.0;  ///< The same of the force [m/s^2].
  int floor_windows_ = 0;     ///< Number of windows in these means.
};

}  // namespace understory::lidar_imu_input
