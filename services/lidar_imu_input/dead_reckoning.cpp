#include "services/lidar_imu_input/dead_reckoning.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// Rotation by +90 degrees.
const Eigen::Matrix2d& quarter_rotation() {
  static const Eigen::Matrix2d rotation = (Eigen::Matrix2d() << 0.0, -1.0, 1.0, 0.0).finished();
  return rotation;
}

}  // namespace

DeadReckoning::DeadReckoning(const ImuParameters& imu) : imu_(imu) {
  covariance_.diagonal() << 0.0, 0.0, 0.0, square(kStartSpeed_mps), 1.0,
      square(imu.gyro_bias_sigma), square(imu.force_bias_sigma), square(imu.force_bias_sigma);
}

void DeadReckoning::propagate(const LevelSample& a, const LevelSample& b) {
  const double dt = static_cast<double>(b.utime - a.utime) * 1e-6;

  // Mean rate and force, both ends rotated to the middle of the step.
  const double rate = 0.5 * (a.yaw_rate_rad_s + b.yaw_rate_rad_s) - bias_(0);
  const Eigen::Matrix2d back = planar_rotation(-0.5 * rate * dt);
  const Eigen::Vector2d force_bias = bias_.tail<2>();
  const Eigen::Vector2d force =
      0.5 * (back * (a.force_mps2 - force_bias) + back.transpose() * (b.force_mps2 - force_bias));

  // Transition of the error (pose, velocity, bias).
  const Eigen::Matrix2d& turn = quarter_rotation();
  const Eigen::Vector2d velocity_turned = geometry::perpendicular(velocity_);
  Covariance step = Covariance::Identity();
  step.block<2, 2>(0, 0) -= rate * dt * turn;
  step.block<2, 1>(0, 2) = velocity_turned * dt;
  step.block<2, 2>(0, 3) = Eigen::Matrix2d::Identity() * dt;
  step(2, 5) = -dt;
  step.block<2, 2>(3, 3) -= rate * dt * turn;
  step.block<2, 1>(3, 5) = velocity_turned * dt;
  step.block<2, 2>(3, 6) = -Eigen::Matrix2d::Identity() * dt;

  // Noise: an error of the rate moves heading and velocity together.
  const bool saturated = a.is_saturated || b.is_saturated;
  const double gyro = square(saturated ? imu_.saturation_gyro_noise : imu_.gyro_noise) +
                      square(imu_.gyro_scale_sigma * rate);
  const double accelerometer =
      square(saturated ? imu_.saturation_force_noise : imu_.force_noise) + square(imu_.level_noise);
  Eigen::Matrix<double, 8, 1> gyro_input = Eigen::Matrix<double, 8, 1>::Zero();
  gyro_input(2) = 1.0;
  gyro_input.segment<2>(3) = -velocity_turned;
  covariance_ =
      step * covariance_ * step.transpose() + gyro * dt * gyro_input * gyro_input.transpose();
  covariance_.block<2, 2>(3, 3).diagonal().array() += accelerometer * dt;
  covariance_(5, 5) += square(imu_.gyro_bias_walk) * dt;
  covariance_.block<2, 2>(6, 6).diagonal().array() += square(imu_.force_bias_walk) * dt;

  // The motion itself.
  const Eigen::Vector2d moved = velocity_ * dt + 0.5 * dt * dt * (back.transpose() * force);
  pose_ = pose_ * geometry::SE2(moved, rate * dt);
  velocity_ = back * (back * velocity_ + force * dt);
}

void DeadReckoning::propagate_velocity(const LevelSample& a, const LevelSample& b) {
  const geometry::SE2 pose = pose_;
  const Eigen::Matrix3d covariance = pose_covariance();
  propagate(a, b);
  pose_ = pose;
  set_pose_covariance(covariance);
}

void DeadReckoning::set_pose_covariance(const Eigen::Matrix3d& covariance) {
  covariance_.topRightCorner<3, 5>().setZero();
  covariance_.bottomLeftCorner<5, 3>().setZero();
  covariance_.topLeftCorner<3, 3>() = covariance;
}

void DeadReckoning::bridge(const geometry::SE2WithCovariance& motion) {
  const geometry::SE2WithCovariance moved = compound({pose_, pose_covariance()}, motion);
  pose_ = moved.mean;
  set_pose_covariance(moved.covariance);
  covariance_.block<2, 2>(3, 3).diagonal().array() += square(kBridgeSpeed);
}

void DeadReckoning::update(const Row& row, double residual, double variance, bool moves_heading) {
  const Eigen::Matrix<double, 8, 1> spread = covariance_ * row.transpose();
  const double total = row.dot(spread) + variance;

  // The position never jumps, the heading only if it is measured: a gain that is not optimal needs
  // Joseph's form.
  Eigen::Matrix<double, 8, 1> gain = spread / total;
  gain.head<2>().setZero();
  if (!moves_heading) gain(2) = 0.0;
  const Covariance left = Covariance::Identity() - gain * row;
  covariance_ = left * covariance_ * left.transpose() + variance * gain * gain.transpose();

  if (moves_heading) pose_ = geometry::SE2(pose_.translation(), pose_.theta() + gain(2) * residual);
  velocity_ += gain.segment<2>(3) * residual;
  bias_ += gain.segment<3>(5) * residual;
}

void DeadReckoning::add_velocity(const Eigen::Vector2d& direction, const Eigen::Vector2d& at,
                                 double residual_mps, double sigma_mps) {
  Row row = Row::Zero();
  row.segment<2>(3) = direction.transpose();
  row(5) = -direction.dot(geometry::perpendicular(at));
  update(row, residual_mps, square(sigma_mps), false);
}

void DeadReckoning::add_standstill(double velocity_sigma_mps) {
  for (int axis = 0; axis < 2; ++axis) {
    Row row = Row::Zero();
    row(3 + axis) = 1.0;
    update(row, -velocity_(axis), square(velocity_sigma_mps), false);
  }
}

void DeadReckoning::add_heading(double residual_rad, double sigma_rad) {
  Row row = Row::Zero();
  row(2) = 1.0;
  update(row, residual_rad, square(sigma_rad), true);
}

void DeadReckoning::set_velocity(const LevelVelocity& velocity) {
  velocity_ = velocity.velocity_mps;
  covariance_.middleRows<2>(3).setZero();
  covariance_.middleCols<2>(3).setZero();
  covariance_.block<2, 2>(3, 3) = velocity.covariance_m2ps2;
}

void DeadReckoning::set_gyro_bias(double bias_rad_s, double sigma_rad_s) {
  bias_(0) = bias_rad_s;
  covariance_.row(5).setZero();
  covariance_.col(5).setZero();
  covariance_(5, 5) = square(sigma_rad_s);
}

void DeadReckoning::correct(const model::VelocityCorrection& correction,
                            const Eigen::Vector2d& then_velocity, double then_heading) {
  const Eigen::Matrix2d turn = planar_rotation(then_heading - pose_.theta());
  velocity_ += turn * (correction.velocity_mps - then_velocity);
  bias_ = correction.bias;
  covariance_.topRightCorner<3, 5>().setZero();
  covariance_.bottomLeftCorner<5, 3>().setZero();
  Eigen::Matrix<double, 5, 5> carry = Eigen::Matrix<double, 5, 5>::Identity();
  carry.topLeftCorner<2, 2>() = turn;
  covariance_.bottomRightCorner<5, 5>() = carry * correction.covariance * carry.transpose();
}

}  // namespace understory::lidar_imu_input
