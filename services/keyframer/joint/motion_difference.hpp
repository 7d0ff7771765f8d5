// Difference of two measurements of one motion, and its Jacobian by calibration errors.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"

namespace understory::keyframer::joint {

/// Number of calibration parameters.
inline constexpr int kCalibrationNumbers = 6;
/// Yaw [rad] and position (two numbers, [m]) of the sensor, excess share of the wheels' path,
/// lateness of scans [s], bias of the gyro [rad/s].
using CalibrationNumbers = Eigen::Matrix<double, kCalibrationNumbers, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationNumbers, kCalibrationNumbers>;
/// Their indices.
enum CalibrationNumber { kYaw = 0, kPlace = 1, kScale = 3, kLate = 4, kGyroBias = 5 };

/// The motion between two scans by landmarks and by odometry.
struct TwoMotions {
  geometry::SE2WithCovariance by_landmarks;
  geometry::SE2WithCovariance by_odometry;
  Eigen::Vector3d then_twist =
      Eigen::Vector3d::Zero();                          ///< By odometry, at its start [m/s, rad/s].
  Eigen::Vector3d now_twist = Eigen::Vector3d::Zero();  ///< At its end.
  double gyro_variance = 0.0;  ///< Of the rotation by odometry [rad^2]: white noise alone.
  double seconds = 0.0;
  bool has_wheels = false;
};

/// Translation by landmarks minus that by odometry, in the axes of the start.
struct WayDifference {
  Eigen::Vector2d value_m;
  Eigen::Matrix2d covariance_m2;
  Eigen::Matrix<double, 2, kCalibrationNumbers>
      jacobian;  ///< Of value_m, at a correct calibration.
};
WayDifference way_difference(const TwoMotions& motions);

/// Rotation by landmarks minus that by odometry.
struct TurnDifference {
  double value_rad = 0.0;
  double variance_rad2 = 0.0;
  Eigen::Matrix<double, 1, kCalibrationNumbers> jacobian;
};
/// `overlapping`: number of successive motions that share each part of odometry.
TurnDifference turn_difference(const TwoMotions& motions, double overlapping);

}  // namespace understory::keyframer::joint
