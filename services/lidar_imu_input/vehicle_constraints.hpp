// Kinematic constraints of a vehicle on wheels, as measurements of its velocity.
#pragma once

#include <Eigen/Core>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/dead_reckoning.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/wheel_speeds.hpp"

namespace understory::lidar_imu_input {

/// The rear axle in frame `vehicle`.
struct AxleFrame {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Of its middle.
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();    ///< Unit.
  Eigen::Vector3d left = Eigen::Vector3d::UnitY();       ///< Unit.

  /// From `CarGeometry::axle_T_vehicle`.
  static AxleFrame of(const CarGeometry& car);
};

/// Updates the attitude filter and the dead reckoning by the wheels' measurements and by the
/// constraints: no sideways and vertical motion of the rear axle, and a bounded speed.
class VehicleConstraints {
 public:
  /// `car`: position of the rear axle.
  VehicleConstraints(const ConstraintParameters& parameters, const CarGeometry& car);

  /// Applies the constraints at an IMU sample (frame vehicle), at most once in `period_s`.
  /// `level_yaw_rate_rad_s`: of the heading, including the bias.
  void apply(const model::ImuSample& sample, double level_yaw_rate_rad_s, bool wheels_are_fresh,
             AttitudeFilter& attitude, DeadReckoning& reckoning);
  /// Applies a measured axle speed: `measured_mps` is the wheels' raw value, `latest` is corrected
  /// by their scale. `then`: the motion at its stamp. `pitch_cosine`: of the vehicle, now.
  void add_wheel_speed(double measured_mps, const SpeedSample& latest, const MotionState& then,
                       double pitch_cosine, AttitudeFilter& attitude,
                       DeadReckoning& reckoning) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.constrained_utime_, self.bounded_utime_);
  }

 private:
  void exclude_slip(const model::ImuSample& sample, double level_yaw_rate_rad_s,
                    AttitudeFilter& attitude, DeadReckoning& reckoning) const;

  ConstraintParameters parameters_;
  AxleFrame axle_;
  model::Utime constrained_utime_ = 0;  ///< Time of the last constraints.
  model::Utime bounded_utime_ = 0;      ///< Time of the last bound of the velocity.
};

}  // namespace understory::lidar_imu_input
