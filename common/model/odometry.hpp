// Relative motion, measured without landmarks.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// Slowly changing errors of the inertial sensors, in `vehicle_level`: gyro about z [rad/s],
/// accelerometer along x and y [m/s^2] (the level's own error included).
using InertialBias = Eigen::Vector3d;

/// Error of (roll, pitch) [rad], about the axes of `vehicle_level`, common to all sweeps levelled
/// with one estimate of the attitude. It is correlated over time: while the vehicle is stationary
/// it is the accelerometer's bias; the vehicle's motion then reduces it.
struct LevelError {
  /// Covariance at the end of the interval [rad^2].
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  /// Error at the end = memory * error at the start + new error with covariance `added` [rad^2].
  Eigen::Matrix2d memory = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d added = Eigen::Matrix2d::Zero();
  /// Tangent of the vehicle's pitch: on a slope an error of roll causes a heading error with this
  /// factor.
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
  /// Covariance of (yaw, velocity, position) in rad, m/s, m, from white noise of the sensors and of
  /// the level.
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
  /// Present where there is an IMU. `from_T_to` includes the same samples (and the wheels, if any):
  /// a user of the preintegration must use only the wheels' translation of `from_T_to`.
  std::optional<Preintegration> inertial = {};
  /// `from_T_to` is from wheels; without them its translation is from dead-reckoned velocity.
  bool has_wheels = false;
  bool is_stationary = false;  ///< The vehicle did not move during the interval.
};

/// Channel REST_LEVEL: error of the attitude that levelled sweeps while the vehicle was last
/// stationary, about the axes of `vehicle_level`, estimated from its motion since then. While
/// stationary it is indistinguishable from the accelerometer's bias.
struct RestLevel {
  Utime utime = 0;  ///< Stamp of the latest measurement.
  std::uint64_t sequence = 0;
  Utime rest_from_utime = 0;                             ///< Begin of the stationary interval.
  Utime rest_utime = 0;                                  ///< End of the stationary interval.
  Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();   ///< Roll, pitch.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Covariance of `error_rad` [rad^2].
  /// Covariance of `error_rad` minus the level's error at `utime`, about the same axes [rad^2].
  Eigen::Matrix2d change_covariance = Eigen::Matrix2d::Zero();
};

}  // namespace understory::model
