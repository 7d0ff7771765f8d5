// A car on a route: its pose, rates and accelerations at any time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/geometry/se2.hpp"
#include "sim/ground.hpp"
#include "sim/route.hpp"
#include "sim/uniform_spline.hpp"

namespace understory::sim {

/// Frame `vehicle`: x forward, y left, z up; origin on the ground below the middle of the rear
/// axle.
struct VehicleParameters {
  double wheelbase_m = 2.7;
  double track_m = 1.6;
  double suspension_hz = 1.4;       ///< Natural frequency of the body on its springs.
  double suspension_damping = 0.4;  ///< Of critical.
  double pitch_per_mps2 = 0.008;    ///< [rad] Nose up per forward acceleration.
  double roll_per_mps2 = 0.012;     ///< [rad] Outwards per acceleration to the side.
};

/// Speeds, accelerations and stops of the drive.
struct SpeedParameters {
  /// At the start, for the calibration of an IMU. Below a second the drive begins with a jolt: the
  /// suspension settles on the slope in this time. To begin in motion, skip the first readings.
  double standstill_s = 22.0;
  double end_standstill_s = 3.0;
  double cruise_mps = 5.0;
  double acceleration_mps2 = 1.0;
  double braking_mps2 = 1.5;
  double lateral_mps2 = 1.5;  ///< Largest in curves.
  /// A stop of `seconds` on the route.
  struct Stop {
    double along_m = 0.0;  ///< Of the route.
    double seconds = 5.0;
  };
  std::vector<Stop> stops;  ///< In order of along_m.
};

/// Pose and motion of the car, exactly: rates and accelerations are the derivatives of the pose.
struct VehicleState {
  double time_s = 0.0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame `world`.
  Eigen::Quaterniond world_Q_vehicle = Eigen::Quaterniond::Identity();
  double roll_rad = 0.0;  ///< world_Q_vehicle = Rz(yaw) Ry(pitch) Rx(roll).
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();                 ///< Frame `world`.
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();            ///< Frame `world`.
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();           ///< Frame `vehicle`.
  Eigen::Vector3d angular_acceleration_rad_s2 = Eigen::Vector3d::Zero();  ///< Frame `vehicle`.

  /// The pose in three dimensions.
  Eigen::Isometry3d world_T_vehicle() const;
  /// Heading and position in the plan: `world` from `vehicle_level`.
  geometry::SE2 world_T_level() const { return {position_m.head<2>(), yaw_rad}; }
};

/// The motion is simulated once (20 ms steps, 48 bytes each) and then interpolated by a smooth
/// curve over time; all other quantities are derived from it.
class VehicleMotion {
 public:
  /// Simulates the drive along `route` on `ground`.
  VehicleMotion(const Route& route, const Ground& ground, const VehicleParameters& vehicle,
                const SpeedParameters& speed);
  /// A recorded motion of any body (for example a flying one): `poses` are (x, y, z, roll, pitch,
  /// yaw) in `world`, yaw unwrapped, every `step_s` [s] from time 0; at least one. The motion is
  /// the UniformSpline of these control points.
  static VehicleMotion replayed(std::vector<UniformSpline<6>::Vector> poses, double step_s);

  /// From the first to the last instant, both stationary.
  double duration_s() const { return pose_.end(); }
  /// Path length from start to end.
  double driven_m() const { return driven_m_; }
  /// The state at a time, clamped to [0, duration].
  VehicleState at(double time_s) const;
  /// The parameters of the constructor.
  const VehicleParameters& parameters() const { return vehicle_; }

 private:
  VehicleMotion() = default;

  VehicleParameters vehicle_;
  UniformSpline<6> pose_;  ///< x, y, z, roll, pitch, yaw (unwrapped).
  double driven_m_ = 0.0;
};

}  // namespace understory::sim
