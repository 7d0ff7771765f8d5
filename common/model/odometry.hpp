// Relative motion that no landmark has touched.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// Errors of the inertial sensors that last, in `vehicle_level`: gyro about z [rad/s],
/// accelerometer along x and y [m/s^2] (the level's own error included).
using InertialBias = Eigen::Vector3d;

/// Error of (roll, pitch) [rad], about the axes of `vehicle_level`, that all sweeps levelled with
/// one estimate of the attitude share. It lasts: while the vehicle stands it is the accelerometer's
/// bias; what the vehicle's motion then tells takes it away.
struct LevelError {
  /// At the end of the interval.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  /// Error at the end = memory * error at the start + something new of covariance `added`.
  Eigen::Matrix2d memory = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d added = Eigen::Matrix2d::Zero();
  /// Of the vehicle's pitch: on a slope a wrong roll is a wrong heading too, by this times as much.
  double pitch_tangent = 0.0;
};

/// IMU samples between two stamps, integrated in frame `vehicle_level` of the first stamp, gravity
/// taken out (preintegration, Lupton & Sukkarieh 2012; Forster et al. 2017, in the plane). With
/// start pose (R, p) and velocity v (both in the map) over `seconds`:
///   R' = R Rot(yaw),  v' = v + R velocity,  p' = p + v seconds + R position.
struct Preintegration {
  double seconds = 0.0;
  double yaw_rad = 0.0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  /// Of (yaw, velocity, position): white noise of the sensors and of the level.
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  /// d(yaw, velocity, position) / d(bias) at `bias`, which was subtracted from the samples.
  Eigen::Matrix<double, 5, 3> bias_jacobian = Eigen::Matrix<double, 5, 3>::Zero();
  InertialBias bias = InertialBias::Zero();
  LevelError level;
};

/// Channel ODOMETRY: motion of the vehicle between two stamps, from wheels, from preintegrated IMU
/// or both.
struct Odometry {
  Utime from_utime = 0;
  Utime utime = 0;  ///< End of the interval.
  std::uint64_t sequence = 0;
  geometry::SE2 from_T_to;
  /// Covariance of `from_T_to` (tangent order x, y, theta; right perturbation).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Where there is an IMU. `from_T_to` is then made of the same samples (and of the wheels, where
  /// there are any): whoever uses the preintegration takes from `from_T_to` only what wheels said.
  std::optional<Preintegration> inertial = {};
  /// Wheels stood behind `from_T_to`; without them its translation rests on dead-reckoned velocity.
  bool has_wheels = false;
  bool is_stationary = false;  ///< The vehicle was found to stand still during the interval.
};

}  // namespace understory::model
