// Detection of standstills, and the gyro's bias during them.
#pragma once

#include <optional>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/dead_reckoning.hpp"
#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/standstill.hpp"

namespace understory::lidar_imu_input {

/// Other information on the velocity while the IMU is quiet.
struct VelocityEvidence {
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();      ///< Dead reckoned, vehicle_level.
  Eigen::Matrix2d covariance_m2ps2 = Eigen::Matrix2d::Zero();  ///< Of it.
  bool wheels_are_fresh = false;
  model::Utime corrected_utime = 0;  ///< Time of the last applied VELOCITY_CORRECTION.

  /// From the present dead reckoning.
  static VelocityEvidence of(const DeadReckoning& reckoning, bool wheels_are_fresh,
                             model::Utime corrected_utime);
};

/// Owns the standstill detector, the gyro's bias estimated while stationary, and the time of the
/// last motion. Quiet samples alone are no standstill if the velocity contradicts it: a smooth road
/// is quiet, too.
class StationaryMonitor {
 public:
  /// `imu`: prior and random walk of the gyro's bias.
  StationaryMonitor(const StandstillParameters& standstill, const ImuParameters& imu);

  /// Adds an IMU sample (frame vehicle, with the lever force), `seconds` after the previous one.
  /// `gyro_bias`: the attitude filter's [rad/s].
  void add(const model::ImuSample& sample, double seconds, const Eigen::Vector3d& gyro_bias,
           const VelocityEvidence& velocity);
  /// Updates the bias of the heading's rate from the attitude filter, at rest or with its value at
  /// the last rest.
  void learn_bias(const AttitudeFilter& attitude);
  /// Adds the speed of the wheels [m/s].
  void add_wheel_speed(model::Utime utime, double speed_mps) {
    detector_.add_wheel_speed(utime, speed_mps);
  }
  /// The vehicle may have moved until `utime`: at the first sample, or the end of a gap.
  void begin_at(model::Utime utime);

  /// At the latest sample.
  bool is_stationary() const { return detector_.is_stationary(); }
  /// Whether one standstill was long enough for calibration.
  bool is_calibrated() const { return detector_.is_calibrated(); }
  /// Whether it has not moved since `utime`.
  bool is_stationary_since(model::Utime utime) const { return moved_utime_ <= utime; }
  /// Time of the last detected motion.
  model::Utime moved_utime() const { return moved_utime_; }
  /// Bias of the heading's rate, from standstills only; its sigma grows while the vehicle moves.
  const YawRateBias& bias() const { return bias_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.detector_, self.bias_, self.moved_utime_, self.denied_since_);
  }

 private:
  bool allows_stationary(model::Utime now, const VelocityEvidence& velocity);

  StandstillParameters parameters_;
  double gyro_bias_walk_;  ///< [rad/s/sqrt(s)]
  StandstillDetector detector_;
  YawRateBias bias_;
  model::Utime moved_utime_ = 0;  ///< Time of the last detected motion.
  std::optional<model::Utime>
      denied_since_;  ///< Time since which the velocity contradicts a standstill.
};

}  // namespace understory::lidar_imu_input
