// Parameters of the input stage: mounting and accuracy of the sensors.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::lidar_imu_input {

/// Mounting of a sensor: vehicle_T_sensor. Rotation: roll, then pitch, then yaw about fixed axes.
struct SensorMount {
  double x_m = 0.0;  ///< Forward of the vehicle's origin.
  double y_m = 0.0;  ///< Left of it.
  double z_m = 0.0;  ///< Above it.
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;

  /// Of the sensor in frame vehicle.
  Eigen::Vector3d position_m() const { return {x_m, y_m, z_m}; }
  /// vehicle_Q_sensor.
  Eigen::Quaterniond rotation() const;
  /// Transforms sensor coordinates to frame vehicle.
  Eigen::Isometry3d vehicle_T_sensor() const;
};

/// The IMU: mount, noise, ranges.
struct ImuParameters {
  SensorMount mount;
  double gyro_noise = 3e-4;         ///< [rad/s/sqrt(Hz)]
  double force_noise = 4e-3;        ///< [m/s^2/sqrt(Hz)]
  double gyro_bias_sigma = 0.01;    ///< At start [rad/s].
  double force_bias_sigma = 0.05;   ///< At start [m/s^2].
  double gyro_bias_walk = 3e-5;     ///< [rad/s/sqrt(s)]
  double force_bias_walk = 3e-4;    ///< [m/s^2/sqrt(s)]
  double gyro_scale_sigma = 0.002;  ///< Relative error of the rate.
  double level_noise = 5e-3;  ///< Of the subtracted gravity, from the level error [m/s^2/sqrt(Hz)].
  double gyro_range_rad_s = 8.0;         ///< A rate this large is saturated.
  double force_range_mps2 = 78.0;        ///< A force this large is saturated.
  double saturation_gyro_noise = 2.0;    ///< Across omitted samples [rad/s/sqrt(Hz)].
  double saturation_force_noise = 20.0;  ///< Across omitted samples [m/s^2/sqrt(Hz)].
  double max_gap_s = 0.15;               ///< Samples at a larger distance in time are not joined.
};

/// Time over which the rate is differentiated, for the force at the IMU when the vehicle rotates
/// about its origin.
constexpr double kLeverBaseline_s = 0.02;

/// Detection of standstills, and their use for calibration.
struct StandstillParameters {
  double window_s = 0.5;             ///< Length of the examined samples.
  double gyro_sigma_rad_s = 0.02;    ///< Largest spread of the rate in the window.
  double force_sigma_mps2 = 0.25;    ///< Largest spread of the force in the window.
  double gyro_mean_rad_s = 0.06;     ///< Largest mean rate, before the bias is known.
  double wheel_speed_mps = 0.05;     ///< Largest speed of the wheels.
  double floor_factor = 2.0;         ///< Largest spread, in units of that at the first standstill.
  double calibration_s = 20.0;       ///< A standstill this long, without a break, calibrates.
  double velocity_sigma_mps = 0.01;  ///< Of velocity zero at a standstill.
};

/// Kinematic constraints of a car, as measurements of its velocity.
struct ConstraintParameters {
  bool nonholonomic = true;         ///< Wheels do not slip sideways, nor leave the ground.
  double side_slip_mps = 0.05;      ///< Sideways velocity of the axle, sigma.
  double side_slip_scale = 0.01;    ///< The same, of the speed.
  double vertical_mps = 0.1;        ///< Velocity across the floor, sigma.
  double vertical_scale = 0.02;     ///< The same, of the speed.
  double typical_speed_mps = 15.0;  ///< Of the vehicle; keeps unaided velocity bounded.
  double wheel_sigma_mps = 0.05;    ///< Of the wheels' speed, for the attitude.
  double period_s = 0.1;            ///< Between two uses: their errors are correlated.
};

/// The 3-D laser.
struct DeskewParameters {
  SensorMount mount;
  double revolution_s = 0.1;  ///< Time of one revolution, for sweeps without times.
  /// Sweeps without times get them from the azimuth: "none", "clockwise", "counterclockwise".
  std::string times_from_azimuth = "none";
  /// Direction of its points, seen from above in its own frame: "any" is not checked.
  std::string turns = "any";
  double min_range_m = 0.0;  ///< Nearer points are on the vehicle itself.
};

/// The one-plane laser.
struct PlanarLaserParameters {
  SensorMount mount;
};

/// Timing of the outputs.
struct OutputParameters {
  double max_increment_s = 0.1;         ///< Longest increment of odometry.
  double lag_s = 0.15;                  ///< Time that an increment waits for a sweep to end it.
  double max_wait_s = 0.3;              ///< Time that a sweep waits for motion.
  double raw_pose_period_s = 0.02;      ///< Between two RAW_POSE.
  double correction_delay_s = 0.15;     ///< [D] From a correction's stamp to its effect.
  double velocity_correlation_s = 5.0;  ///< Correlation time of the dead-reckoned velocity's error.
};

/// Limits for faults of a sensor.
struct FaultParameters {
  double silent_s = 0.3;        ///< IMU or wheels without a sample for this time.
  double sweep_silent_s = 0.3;  ///< The same for the lasers.
  double frozen_s = 0.5;        ///< Equal IMU samples for this time.
  double clock_jump_s = 0.5;    ///< Stamps that go back, or are ahead of the others, by more.
  int resync_samples = 5;    ///< Number of evenly spaced stamps after which the clock is followed.
  double reorder_s = 0.025;  ///< Time that a sample waits for a missing earlier one.
};

/// Sensors of the vehicle: HEALTH is not OK if one of them never sends.
struct ExpectedSensors {
  bool imu = false;
  bool wheels = false;
  bool sweep = false;
  bool scan = false;
};

/// All parameters of the stage.
struct LidarImuInputParameters {
  ImuParameters imu;
  WheelOdometryParameters wheels;
  StandstillParameters standstill;
  ConstraintParameters constraint;
  DeskewParameters lidar;
  PlanarLaserParameters planar;
  OutputParameters output;
  FaultParameters fault;
  ExpectedSensors expected;
  bool gnss_aided = false;  ///< RAW_POSE gets its velocity from GNSS: a reference, not for mapping.
};

}  // namespace understory::lidar_imu_input
