// Sensors of the vehicle's own motion: inertial unit, wheels, satellite navigation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/wheels.hpp"
#include "sim/vehicle_motion.hpp"

namespace understory::sim {

inline constexpr double kGravity = 9.81;  ///< [m/s^2], equal to common/model/imu.hpp.

/// Rate and errors of an inertial unit.
struct ImuParameters {
  double rate_hz = 200.0;
  double gyro_noise = 1.7e-4;              ///< White [rad/s/sqrt(Hz)]; 0.01 degrees/s/sqrt(Hz).
  double gyro_bias_sigma = 2e-3;           ///< Of the bias at the start [rad/s].
  double gyro_bias_walk = 1e-5;            ///< [rad/s/sqrt(s)]
  double accelerometer_noise = 2e-3;       ///< White [m/s^2/sqrt(Hz)].
  double accelerometer_bias_sigma = 0.03;  ///< [m/s^2]
  double accelerometer_bias_walk = 1e-4;   ///< [m/s^2/sqrt(s)]
  double scale_sigma = 5e-4;               ///< Of the scale error of each axis.
  double gyro_limit_rad_s = 0.0;           ///< Saturation; 0 = never.
  double accelerometer_limit_mps2 = 0.0;   ///< Saturation; 0 = never.
  Eigen::Isometry3d vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.6));
};

/// Measurement of an ideal inertial unit: frame `sensor`, at the sensor's position.
model::ImuSample true_imu_sample(const VehicleState& state,
                                 const Eigen::Isometry3d& vehicle_T_sensor);

/// Errors are correlated in time: samples are made in order.
class SimulatedImu {
 public:
  /// Draws biases and scales from `seed`.
  SimulatedImu(const ImuParameters& parameters, std::uint64_t seed);
  /// Time of the next sample.
  double next_time_s() const { return static_cast<double>(count_) / parameters_.rate_hz; }
  /// The sample at next_time_s().
  model::ImuSample next(const VehicleMotion& motion, model::Utime utime_of_start = 0);

  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }  ///< Of the last sample [rad/s].
  /// As given to the constructor.
  const ImuParameters& parameters() const { return parameters_; }

 private:
  Eigen::Vector3d normal3(double sigma);

  ImuParameters parameters_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accelerometer_bias_;
  Eigen::Vector3d gyro_scale_;
  Eigen::Vector3d accelerometer_scale_;
  std::uint64_t count_ = 0;
};

/// Rate and errors of wheel encoder and steering sensor.
struct WheelParameters {
  double rate_hz = 100.0;
  double scale_sigma = 5e-3;                ///< Of the scale error, drawn once (wrong radius).
  double speed_sigma_mps = 0.02;            ///< White; none while the vehicle is stationary.
  double steering_sigma_rad = 5e-3;         ///< White.
  double steering_offset_sigma_rad = 3e-3;  ///< Drawn once.
  double encoder_left_m = 0.0;  ///< The wheel with the encoder, left of the rear axle's middle.
};

/// Errors are correlated in time: samples are made in order.
class SimulatedWheels {
 public:
  /// Draws scale and offset from `seed`.
  SimulatedWheels(const WheelParameters& parameters, std::uint64_t seed);
  /// Time of the next sample.
  double next_time_s() const { return static_cast<double>(count_) / parameters_.rate_hz; }
  /// The sample at next_time_s().
  model::WheelSample next(const VehicleMotion& motion, model::Utime utime_of_start = 0);

 private:
  WheelParameters parameters_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  double scale_ = 1.0;
  double steering_offset_rad_ = 0.0;
  std::uint64_t count_ = 0;
};

/// Rate and errors of a satellite receiver.
struct GnssParameters {
  double rate_hz = 2.0;
  double sigma_m = 0.5;              ///< White, per axis.
  double drift_sigma_m = 0.5;        ///< Of an additional slow error (Gauss-Markov), per axis.
  double drift_time_s = 120.0;       ///< Its correlation time.
  double velocity_sigma_mps = 0.05;  ///< Per axis.
  /// No fix from `from_s` to `to_s` of the drive.
  struct Outage {
    double from_s = 0.0;
    double to_s = 0.0;
  };
  std::vector<Outage> outages;
  Eigen::Vector3d antenna_m = {0.5, 0.0, 1.6};  ///< Frame `vehicle`.
};

/// Errors are correlated in time: fixes are made in order.
class SimulatedGnss {
 public:
  /// Draws the slow error's start from `seed`.
  SimulatedGnss(const GnssParameters& parameters, std::uint64_t seed);
  /// Time of the next fix.
  double next_time_s() const { return static_cast<double>(count_) / parameters_.rate_hz; }
  /// The fix at next_time_s(); none during an outage.
  std::optional<model::GnssFix> next(const VehicleMotion& motion, model::Utime utime_of_start = 0);

 private:
  Eigen::Vector2d normal2(double sigma);

  GnssParameters parameters_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  Eigen::Vector2d drift_m_;
  std::uint64_t count_ = 0;
  std::uint64_t fixes_ = 0;
};

}  // namespace understory::sim
