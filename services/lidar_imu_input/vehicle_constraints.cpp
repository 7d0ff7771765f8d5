#include "services/lidar_imu_input/vehicle_constraints.hpp"

#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kBoundPeriod_s = 10.0;

Eigen::Vector3d flat(const Eigen::Vector2d& v) { return {v.x(), v.y(), 0.0}; }

}  // namespace

AxleFrame AxleFrame::of(const CarGeometry& car) {
  const geometry::SE2 vehicle_T_axle = car.axle_T_vehicle.inverse();
  return {flat(vehicle_T_axle.translation()), flat(vehicle_T_axle.rotation().col(0)),
          flat(vehicle_T_axle.rotation().col(1))};
}

VehicleConstraints::VehicleConstraints(const ConstraintParameters& parameters,
                                       const CarGeometry& car)
    : parameters_(parameters), axle_(AxleFrame::of(car)) {}

void VehicleConstraints::apply(const model::ImuSample& sample, double level_yaw_rate_rad_s,
                               bool wheels_are_fresh, AttitudeFilter& attitude,
                               DeadReckoning& reckoning) {
  if (seconds_between(constrained_utime_, sample.utime) < parameters_.period_s) return;
  constrained_utime_ = sample.utime;
  if (parameters_.nonholonomic) exclude_slip(sample, level_yaw_rate_rad_s, attitude, reckoning);

  // Without wheels only this bounds the velocity.
  if (!wheels_are_fresh && seconds_between(bounded_utime_, sample.utime) > kBoundPeriod_s) {
    bounded_utime_ = sample.utime;
    for (const Eigen::Vector3d& direction : {axle_.forward, axle_.left})
      attitude.add_velocity(direction, Eigen::Vector3d::Zero(), -direction.dot(attitude.velocity()),
                            parameters_.typical_speed_mps);
  }
}

void VehicleConstraints::exclude_slip(const model::ImuSample& sample, double level_yaw_rate_rad_s,
                                      AttitudeFilter& attitude, DeadReckoning& reckoning) const {
  const Eigen::Vector3d rate = sample.angular_rate_rad_s - attitude.gyro_bias();
  const Eigen::Vector3d axle = attitude.velocity() + rate.cross(axle_.position_m);
  const double speed = std::abs(axle.dot(axle_.forward));
  const double side = std::hypot(parameters_.side_slip_mps, parameters_.side_slip_scale * speed);
  const double vertical = std::hypot(parameters_.vertical_mps, parameters_.vertical_scale * speed);

  // In frame vehicle: the axle moves neither sideways nor off the ground.
  attitude.add_velocity(axle_.left, axle_.position_m, -axle.dot(axle_.left), side);
  attitude.add_velocity_off_ground(axle_.forward, axle_.position_m, -axle.z(), vertical);

  // In the plane.
  const Eigen::Vector2d at = axle_.position_m.head<2>();
  const Eigen::Vector2d left = axle_.left.head<2>();
  const double yaw_rate = level_yaw_rate_rad_s - reckoning.bias()(0);
  const double slip = left.dot(reckoning.velocity() + yaw_rate * geometry::perpendicular(at));
  reckoning.add_velocity(left, at, -slip, side);
}

void VehicleConstraints::add_wheel_speed(double measured_mps, const SpeedSample& latest,
                                         const MotionState& then, double pitch_cosine,
                                         AttitudeFilter& attitude, DeadReckoning& reckoning) const {
  const double sigma = parameters_.wheel_sigma_mps;
  const Eigen::Vector3d axle = then.velocity_mps + then.rate_rad_s.cross(axle_.position_m);
  attitude.add_wheel_speed(axle_.forward, axle_.position_m, axle.dot(axle_.forward), measured_mps,
                           sigma);

  const Eigen::Vector2d at = axle_.position_m.head<2>();
  const Eigen::Vector2d forward = axle_.forward.head<2>();
  const double predicted =
      forward.dot(then.level_velocity_mps + then.rate_rad_s.z() * geometry::perpendicular(at));
  const double scaled = std::hypot(sigma, latest.scale_sigma * measured_mps);
  reckoning.add_velocity(forward, at, latest.speed_mps * pitch_cosine - predicted, scaled);
}

}  // namespace understory::lidar_imu_input
