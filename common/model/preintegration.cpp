#include "common/model/preintegration.hpp"

namespace understory::model {

Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias) {
  Preintegration moved = inertial;
  const Eigen::Matrix<double, 5, 1> shift = inertial.bias_jacobian * (bias - inertial.bias);
  moved.yaw_rad += shift(0);
  moved.velocity_mps += shift.segment<2>(1);
  moved.position_m += shift.tail<2>();
  moved.bias = bias;
  return moved;
}

Preintegration compound(const Preintegration& first, const Preintegration& second) {
  const Preintegration next = at_bias(second, first.bias);
  const Eigen::Matrix2d rotation = geometry::SE2(0.0, 0.0, first.yaw_rad).rotation();
  const Eigen::Vector2d velocity = rotation * next.velocity_mps;
  const Eigen::Vector2d position = rotation * next.position_m;

  Preintegration sum;
  sum.bias = first.bias;
  sum.seconds = first.seconds + next.seconds;
  sum.yaw_rad = first.yaw_rad + next.yaw_rad;
  sum.velocity_mps = first.velocity_mps + velocity;
  sum.position_m = first.position_m + next.seconds * first.velocity_mps + position;

  // Propagation of each one's errors, in (yaw, velocity, position).
  Eigen::Matrix<double, 5, 5> of_first = Eigen::Matrix<double, 5, 5>::Identity();
  of_first.block<2, 1>(1, 0) = geometry::perpendicular(velocity);
  of_first.block<2, 1>(3, 0) = geometry::perpendicular(position);
  of_first.block<2, 2>(3, 1) = next.seconds * Eigen::Matrix2d::Identity();
  Eigen::Matrix<double, 5, 5> of_second = Eigen::Matrix<double, 5, 5>::Identity();
  of_second.block<2, 2>(1, 1) = rotation;
  of_second.block<2, 2>(3, 3) = rotation;
  sum.covariance = of_first * first.covariance * of_first.transpose() +
                   of_second * next.covariance * of_second.transpose();
  sum.bias_jacobian = of_first * first.bias_jacobian + of_second * next.bias_jacobian;

  sum.level = next.level;
  sum.level.memory = next.level.memory * first.level.memory;
  sum.level.added =
      next.level.memory * first.level.added * next.level.memory.transpose() + next.level.added;
  return sum;
}

Eigen::Vector2d added_accelerometer_bias(const Preintegration& inertial) {
  constexpr double kWalk = 1e-3;  // m/s^2/sqrt(s)
  constexpr double kGravity_mps2 = 9.81;
  const Eigen::Vector2d level = inertial.level.added.diagonal();
  // An error of roll acts sideways, one of pitch forward.
  return Eigen::Vector2d::Constant(kWalk * kWalk * inertial.seconds) +
         kGravity_mps2 * kGravity_mps2 * level.reverse();
}

}  // namespace understory::model
