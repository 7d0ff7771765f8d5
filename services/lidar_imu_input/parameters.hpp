// What the input stage is told about the vehicle's sensors.
#pragma once

#include <Eigen/Geometry>

#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::lidar_imu_input {

/// Where a sensor sits: vehicle_T_sensor. Rotation: roll, then pitch, then yaw about fixed axes.
struct SensorMount {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;

  Eigen::Vector3d position_m() const { return {x_m, y_m, z_m}; }
  Eigen::Quaterniond rotation() const;
  Eigen::Isometry3d vehicle_T_sensor() const;
};

struct ImuParameters {
  SensorMount mount;
  double gyro_noise = 3e-4;              ///< [rad/s/sqrt(Hz)]
  double force_noise = 4e-3;             ///< [m/s^2/sqrt(Hz)]
  double gyro_bias_sigma = 0.01;         ///< At start [rad/s].
  double force_bias_sigma = 0.05;        ///< At start [m/s^2].
  double gyro_bias_walk = 3e-5;          ///< [rad/s/sqrt(s)]
  double force_bias_walk = 3e-4;         ///< [m/s^2/sqrt(s)]
  double gyro_scale_sigma = 0.002;       ///< Of the rate.
  double level_noise = 5e-3;             ///< Of gravity taken out, from the level [m/s^2/sqrt(Hz)].
  double gyro_range_rad_s = 8.0;         ///< A rate this large is saturated.
  double force_range_mps2 = 78.0;        ///< A force this large is saturated.
  double saturation_gyro_noise = 2.0;    ///< Across left-out samples.
  double saturation_force_noise = 20.0;  ///< Likewise.
  double max_gap_s = 0.15;               ///< Samples farther apart are not joined.
};

/// Over so long the rate is differenced to take out what the IMU feels of turning about the
/// vehicle's origin.
constexpr double kLeverBaseline_s = 0.02;

/// When the vehicle counts as standing, and the calibration that this allows.
struct StandstillParameters {
  double window_s = 0.5;
  double gyro_sigma_rad_s = 0.02;    ///< Largest spread of the rate in the window.
  double force_sigma_mps2 = 0.25;    ///< Largest spread of the force in the window.
  double gyro_mean_rad_s = 0.06;     ///< Largest mean rate, before the bias is known.
  double wheel_speed_mps = 0.05;     ///< Largest speed of the wheels.
  double floor_factor = 2.0;         ///< Largest spread, in units of that seen while calibrating.
  double calibration_s = 20.0;       ///< Standing this long in one piece calibrates.
  double velocity_sigma_mps = 0.01;  ///< Of "the vehicle stands".
};

/// What a car does not do.
struct ConstraintParameters {
  bool nonholonomic = true;         ///< Wheels do not slip sideways, nor leave the ground.
  double side_slip_mps = 0.05;      ///< Sideways velocity of the axle, sigma.
  double side_slip_scale = 0.01;    ///< The same, of the speed.
  double vertical_mps = 0.1;        ///< Velocity across the floor, sigma.
  double vertical_scale = 0.02;     ///< The same, of the speed.
  double typical_speed_mps = 15.0;  ///< Of the vehicle; keeps unaided velocity bounded.
  double wheel_sigma_mps = 0.05;    ///< Of the wheels' speed, for the attitude.
  double period_s = 0.1;            ///< Between two uses: such errors last.
};

struct DeskewParameters {
  SensorMount mount;          ///< Of the laser that scans in space.
  double revolution_s = 0.1;  ///< Of one turn, for sweeps without times.
  /// Sweeps without times get them from the azimuth: "none", "clockwise", "counterclockwise".
  std::string times_from_azimuth = "none";
  double min_range_m = 0.0;  ///< What is nearer is the vehicle itself.
};

struct OutputParameters {
  double max_increment_s = 0.1;  ///< Longest piece of odometry.
  double lag_s = 0.15;           ///< How long a piece without sweep waits for one to end it.
  double max_wait_s = 0.3;       ///< How long a sweep waits for motion.
  double raw_pose_period_s = 0.02;
  double correction_delay_s = 0.15;     ///< [D] From a correction's stamp to its effect.
  double velocity_correlation_s = 5.0;  ///< How long errors of dead-reckoned velocity last.
};

struct FaultParameters {
  double silent_s = 0.3;        ///< IMU or wheels without a sample for so long.
  double sweep_silent_s = 0.3;  ///< The same for the lasers.
  double frozen_s = 0.5;        ///< The very same sample for so long.
  double clock_jump_s = 0.5;    ///< Stamps that go back, or lead the others, by more.
  int resync_samples = 5;       ///< In step with each other, then the clock is believed again.
};

struct LidarImuInputParameters {
  ImuParameters imu;
  WheelOdometryParameters wheels;
  StandstillParameters standstill;
  ConstraintParameters constraint;
  DeskewParameters lidar;
  OutputParameters output;
  FaultParameters fault;
  bool gnss_aided = false;  ///< RAW_POSE takes velocity from GNSS: a reference.
};

}  // namespace understory::lidar_imu_input
