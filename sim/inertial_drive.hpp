// A smooth drive through trunks with inertial and wheel odometry, scan by scan: input of the front
// end's filters, without sweeps.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "sim/forest.hpp"
#include "sim/point_grid.hpp"
#include "sim/shared_errors.hpp"

namespace understory::sim {

/// Trunks used by several drives.
struct TrunkField {
  Forest forest;
  std::unique_ptr<PointGrid> grid;
};
/// A forest drawn from `seed`, with its grid.
TrunkField make_trunk_field(const ForestParameters& parameters, std::uint64_t seed);

/// Sources of the odometry of an InertialDrive.
enum class OdometryKind {
  kInertial,           ///< IMU only.
  kWheels,             ///< Wheels only.
  kInertialAndWheels,  ///< Both in one increment.
  kNone
};

/// Motion, sensors and their errors.
struct InertialDriveParameters {
  double stationary_s = 10.0;  ///< At the start.
  /// Sway of the stationary vehicle's body (engine, wind), drawn anew for each scan; 0 = none.
  double sway_sigma_m = 0.0;  ///< Per axis.
  double sway_sigma_rad = 0.0;
  double sway_sigma_mps = 0.0;  ///< Per axis.
  double speed_mps = 5.0;
  double speed_swing = 0.2;        ///< Share by which the speed varies.
  double acceleration_mps2 = 1.5;  ///< Largest, at the start.
  double loop_length_m = 1200.0;   ///< The path repeats a loop to the left.
  double wiggle_curvature = 0.03;  ///< [1/m] Of its bends.
  double wiggle_length_m = 60.0;   ///< Between bends to the same side.
  double scan_interval_s = 0.1;
  int samples_per_scan = 10;  ///< Of the IMU.
  OdometryKind odometry = OdometryKind::kInertial;
  double gyro_noise = 2e-4;                ///< [rad/s/sqrt(Hz)]
  double accelerometer_noise = 5e-3;       ///< [m/s^2/sqrt(Hz)] Including the level's noise.
  double gyro_bias_sigma = 2e-3;           ///< [rad/s]
  double accelerometer_bias_sigma = 0.05;  ///< [m/s^2]
  double gyro_walk = 1e-5;                 ///< [rad/s/sqrt(s)]
  double accelerometer_walk = 1e-3;        ///< [m/s^2/sqrt(s)]
  double wheel_sigma_m = 0.01;             ///< Per axis of an increment's translation.
  double wheel_sigma_rad = 0.002;          ///< Of an increment's rotation, without an IMU.
  double dead_reckoning_sigma_mps = 0.3;   ///< Of `from_T_to` from an IMU alone.
  double range_m = 40.0;
  double detection_probability = 0.9;  ///< Of every trunk in range, independently.
  double position_sigma_m = 0.1;       ///< Per axis.
  double clutter_share = 0.0;          ///< False detections, as a share of the true ones expected.
  /// True noise of IMU, wheels and detections, relative to the values above, which the messages
  /// state.
  double true_noise_factor = 1.0;
  SharedErrorParameters shared;  ///< Additional errors of trunks that no message states.
};

/// Data between two scans, and the scan.
struct DriveStep {
  std::vector<model::Odometry> odometry;  ///< Ends at the scan.
  model::LandmarkScan scan;
  std::vector<std::int64_t> trunks;  ///< Of each detection; -1 = clutter.
  geometry::SE2 world_T_vehicle;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< Frame world.
  double rate_rad_s = 0.0;
  model::InertialBias bias = model::InertialBias::Zero();
  double driven_m = 0.0;
};

/// Computed step by step, so a drive of any length needs no memory. The IMU's truth is integrated
/// like the samples in `Preintegration`: the odometry has noise and biases and no other error.
class InertialDrive {
 public:
  /// `world` must outlive the drive.
  InertialDrive(const InertialDriveParameters& parameters, const TrunkField& world,
                std::uint64_t seed);
  /// The first call gives the scan at time zero, without odometry.
  DriveStep next();

 private:
  /// One IMU sample's true motion.
  struct Tick {
    double yaw_rad = 0.0;
    Eigen::Vector2d acceleration_mps2 = Eigen::Vector2d::Zero();  ///< Frame body at mid-rotation.
  };
  /// Pose and velocity of the vehicle, frame world.
  struct Body {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double theta_rad = 0.0;
    Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
    double rate_rad_s = 0.0;

    geometry::SE2 pose() const { return {position_m, theta_rad}; }
    /// Rotates by `yaw_rad` within `dt`; the velocity at its end is `velocity_mps_after`.
    Tick move(double dt, double yaw_rad, const Eigen::Vector2d& velocity_mps_after);
  };
  /// Progress of the vehicle along the loop.
  struct Progress {
    double time_s = 0.0;
    double speed_mps = 0.0;
    double driven_m = 0.0;
    double phase_rad = 0.0;  ///< Of the bends.
  };
  /// The sway of a stationary body between two scans.
  struct Sway {
    geometry::SE2 parked;     ///< Its mean pose.
    double rate_rad_s = 0.0;  ///< Until the next scan.
    /// [m/s^2] In the first and the second half of the interval.
    Eigen::Matrix2d push = Eigen::Matrix2d::Zero();
  };

  Tick advance(double dt);
  Tick sway(double dt, bool first_half);
  bool sways() const;
  geometry::SE2 sway_place();
  Eigen::Vector2d sway_velocity();
  void begin_sway();
  void walk_bias(double dt);
  model::Preintegration drive_samples(double dt);
  model::Odometry drive_increment();
  void observe(DriveStep& step);
  double normal() { return normal_(random_); }

  InertialDriveParameters parameters_;
  const TrunkField& world_;
  SharedErrors shared_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uint64_t scans_ = 0;
  Body body_;
  Progress progress_;
  Sway sway_;
  model::InertialBias bias_ = model::InertialBias::Zero();
};

}  // namespace understory::sim
