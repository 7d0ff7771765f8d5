#include "services/lidar_imu_input/attitude_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/geometry/decompositions.hpp"
#include "common/model/level.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kStartTilt_rad = 0.1;  // 1 m/s^2 taken for gravity

constexpr double kWheelScaleSigma = 0.02;
constexpr double kWheelScaleWalk = 2e-4;  // per square root of a second

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond rotation_of(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle));
}

}  // namespace

RollPitchYaw roll_pitch_yaw(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d m = rotation.toRotationMatrix();
  return {std::atan2(m(2, 1), m(2, 2)), std::asin(std::clamp(-m(2, 0), -1.0, 1.0)),
          std::atan2(m(1, 0), m(0, 0))};
}

namespace {

/// Ry(pitch) Rx(roll) of a rotation.
Eigen::Quaterniond tilt_of(const Eigen::Quaterniond& rotation) {
  const RollPitchYaw angles = roll_pitch_yaw(rotation);
  return Eigen::Quaterniond(Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitX()));
}

/// (Roll, pitch) of an error of the attitude: errors about the level axes x and y, to first order.
Eigen::Matrix<double, 2, 3> level_of_attitude(const Eigen::Quaterniond& world_Q_vehicle) {
  return tilt_of(world_Q_vehicle).toRotationMatrix().topRows<2>();
}

/// Removes negative eigenvalues from rounding.
Eigen::Matrix2d without_negative(const Eigen::Matrix2d& covariance) {
  const geometry::PrincipalAxes parts =
      geometry::principal_axes(0.5 * (covariance + covariance.transpose()));
  return parts.vectors * parts.values.cwiseMax(0.0).asDiagonal() * parts.vectors.transpose();
}

double pitch_tangent(const Eigen::Quaterniond& world_Q_vehicle) {
  return std::tan(roll_pitch_yaw(world_Q_vehicle).pitch_rad);
}

}  // namespace

AttitudeFilter::AttitudeFilter(const ImuParameters& imu, const Eigen::Vector3d& force)
    : imu_(imu),
      world_Q_vehicle_(geometry::rotation_between(
          force.norm() > 0.1 * kGravity_mps2 ? force : Eigen::Vector3d::UnitZ(),
          Eigen::Vector3d::UnitZ())) {
  covariance_.block<3, 3>(0, 0).diagonal().setConstant(square(kStartTilt_rad));
  covariance_(2, 2) = 1e-12;  // yaw is not estimated
  covariance_.block<3, 3>(3, 3).diagonal() << square(kStartSpeed_mps), 1.0, 0.25;
  covariance_.block<3, 3>(6, 6).diagonal().setConstant(square(imu.gyro_bias_sigma));
  covariance_.block<3, 3>(9, 9).diagonal().setConstant(square(imu.force_bias_sigma));
  covariance_(12, 12) = square(kWheelScaleSigma);
  mark_level();
}

void AttitudeFilter::propagate(const Eigen::Vector3d& rate, const Eigen::Vector3d& force,
                               double seconds, bool saturated) {
  const Eigen::Vector3d w = rate - gyro_bias_;
  const Eigen::Vector3d gravity =
      world_Q_vehicle_.conjugate() * Eigen::Vector3d(0.0, 0.0, -kGravity_mps2);

  // Transition of the error.
  Covariance step = Covariance::Identity();
  step.block<3, 3>(0, 0) -= cross(w) * seconds;
  step.block<3, 3>(0, 6) = -Eigen::Matrix3d::Identity() * seconds;
  step.block<3, 3>(3, 0) = cross(gravity) * seconds;
  step.block<3, 3>(3, 3) -= cross(w) * seconds;
  step.block<3, 3>(3, 6) = -cross(velocity_) * seconds;
  step.block<3, 3>(3, 9) = -Eigen::Matrix3d::Identity() * seconds;

  // Noise. A scale error of the gyro is modelled as noise of the same power over a rotation of
  // about a second.
  const double gyro_noise = saturated ? imu_.saturation_gyro_noise : imu_.gyro_noise;
  const double force_noise = saturated ? imu_.saturation_force_noise : imu_.force_noise;
  const Eigen::Matrix3d lever = cross(velocity_);
  const Eigen::Vector3d scale = imu_.gyro_scale_sigma * w;
  const Eigen::Matrix3d rate_power =
      (Eigen::Vector3d::Constant(square(gyro_noise)) + scale.cwiseAbs2()).asDiagonal();

  covariance_ = step * covariance_ * step.transpose();
  with_mark_ = step * with_mark_;
  with_rest_ = step * with_rest_;
  covariance_.block<3, 3>(0, 0) += rate_power * seconds;
  covariance_.block<3, 3>(3, 3) += lever * rate_power * lever.transpose() * seconds;
  covariance_.block<3, 3>(3, 0) += lever * rate_power * seconds;
  covariance_.block<3, 3>(0, 3) = covariance_.block<3, 3>(3, 0).transpose();
  covariance_.block<3, 3>(3, 3).diagonal().array() += square(force_noise) * seconds;
  covariance_.block<3, 3>(6, 6).diagonal().array() += square(imu_.gyro_bias_walk) * seconds;
  covariance_.block<3, 3>(9, 9).diagonal().array() += square(imu_.force_bias_walk) * seconds;
  covariance_(12, 12) += square(kWheelScaleWalk) * seconds;

  // Velocity with the attitude at the middle of the step.
  const Eigen::Quaterniond half = rotation_of(0.5 * seconds * w);
  const Eigen::Vector3d middle_gravity = half.conjugate() * gravity;
  const Eigen::Vector3d acceleration = force - force_bias_ + middle_gravity;
  velocity_ = half.conjugate() * (half.conjugate() * velocity_ + acceleration * seconds);
  world_Q_vehicle_ = (world_Q_vehicle_ * rotation_of(seconds * w)).normalized();
}

void AttitudeFilter::bridge(double seconds) {
  covariance_.block<2, 2>(0, 0).diagonal().array() += square(model::kTiltWalk) * seconds;
  covariance_.block<3, 3>(3, 3).diagonal().array() += square(kBridgeSpeed) * seconds;
}

void AttitudeFilter::update(const Row& row, double residual, double variance,
                            const Covariance& kept) {
  const Eigen::Matrix<double, 13, 1> spread = covariance_ * row.transpose();
  const double total = row.dot(spread) + variance;
  const Eigen::Matrix<double, 13, 1> gain = kept * spread / total;
  const Eigen::Matrix<double, 13, 1> error = gain * residual;

  // For any gain, like Joseph's form.
  covariance_ +=
      total * gain * gain.transpose() - gain * spread.transpose() - spread * gain.transpose();
  with_mark_ -= gain * (row * with_mark_).eval();
  // Its correction is the negative error of the estimate.
  const Eigen::RowVector2d of_rest = row * with_rest_;
  rest_.error_rad -= of_rest.transpose() * (residual / total);
  rest_.covariance -= of_rest.transpose() * of_rest / total;
  with_rest_ -= spread * of_rest / total;
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();

  twist_rad_ += pitch_tangent(world_Q_vehicle_) *
                level_of_attitude(world_Q_vehicle_).row(0).dot(error.head<3>());
  world_Q_vehicle_ = (world_Q_vehicle_ * rotation_of(error.head<3>())).normalized();
  velocity_ += error.segment<3>(3);
  gyro_bias_ += error.segment<3>(6);
  force_bias_ += error.segment<3>(9);
  wheel_scale_ += error(12);
}

void AttitudeFilter::add_velocity(const Eigen::Vector3d& direction, const Eigen::Vector3d& at,
                                  double residual_mps, double sigma_mps) {
  Row row = Row::Zero();
  row.segment<3>(3) = direction.transpose();
  // d(w x at) / d(gyro bias) = [at]x
  row.segment<3>(6) = direction.transpose() * cross(at);
  update(row, residual_mps, square(sigma_mps));
}

void AttitudeFilter::add_velocity_off_ground(const Eigen::Vector3d& forward,
                                             const Eigen::Vector3d& at, double residual_mps,
                                             double sigma_mps) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Row row = Row::Zero();
  row.segment<3>(3) = up.transpose();
  row.segment<3>(6) = up.transpose() * cross(at);

  Covariance kept = Covariance::Identity();
  kept.block<3, 3>(3, 3) -= forward * forward.transpose();
  kept(12, 12) = 0.0;
  update(row, residual_mps, square(sigma_mps), kept);
}

void AttitudeFilter::add_wheel_speed(const Eigen::Vector3d& forward, const Eigen::Vector3d& at,
                                     double predicted_mps, double measured_mps, double sigma_mps) {
  Row row = Row::Zero();
  row.segment<3>(3) = wheel_scale_ * forward.transpose();
  row.segment<3>(6) = wheel_scale_ * forward.transpose() * cross(at);
  row(12) = predicted_mps;
  update(row, measured_mps - wheel_scale_ * predicted_mps, square(sigma_mps));
}

void AttitudeFilter::add_standstill(const Eigen::Vector3d& rate, double seconds,
                                    double velocity_sigma_mps) {
  for (int axis = 0; axis < 3; ++axis) {
    Row row = Row::Zero();
    row(3 + axis) = 1.0;
    update(row, -velocity_(axis), square(velocity_sigma_mps));
    row.setZero();
    row(6 + axis) = 1.0;
    update(row, rate(axis) - gyro_bias_(axis), square(imu_.gyro_noise) / seconds);
  }
  mark_rest();
}

void AttitudeFilter::mark_rest() {
  with_rest_ = covariance_.leftCols<3>() * level_of_attitude(world_Q_vehicle_).transpose();
  rest_ = {Eigen::Vector2d::Zero(), tilt_covariance(), roll_pitch_yaw(world_Q_vehicle_).yaw_rad};
}

Eigen::Matrix2d AttitudeFilter::tilt_change_covariance() const {
  const Eigen::Rotation2Dd rest_R_now(roll_pitch_yaw(world_Q_vehicle_).yaw_rad - rest_.yaw_rad);
  const Eigen::Matrix<double, 2, 3> level =
      rest_R_now.toRotationMatrix() * level_of_attitude(world_Q_vehicle_);
  const Eigen::Matrix2d now = level * covariance_.block<3, 3>(0, 0) * level.transpose();
  const Eigen::Matrix2d common = level * with_rest_.topRows<3>();
  return without_negative(now + rest_.covariance - common - common.transpose());
}

Eigen::Quaterniond AttitudeFilter::level_Q_vehicle() const { return tilt_of(world_Q_vehicle_); }

LevelVelocity AttitudeFilter::level_velocity() const {
  const Eigen::Matrix3d level_R_vehicle = level_Q_vehicle().toRotationMatrix();
  const Eigen::Matrix3d covariance =
      level_R_vehicle * velocity_covariance() * level_R_vehicle.transpose();
  return {(level_R_vehicle * velocity_).head<2>(), covariance.topLeftCorner<2, 2>()};
}

Eigen::Matrix2d AttitudeFilter::tilt_covariance() const {
  const Eigen::Matrix<double, 2, 3> level = level_of_attitude(world_Q_vehicle_);
  return level * covariance_.block<3, 3>(0, 0) * level.transpose();
}

void AttitudeFilter::mark_level() {
  with_mark_ = covariance_.leftCols<3>() * level_of_attitude(world_Q_vehicle_).transpose();
  marked_ = tilt_covariance();
  twist_rad_ = 0.0;
}

model::LevelError AttitudeFilter::level_since_mark() const {
  const Eigen::Matrix2d shared = level_of_attitude(world_Q_vehicle_) * with_mark_.topRows<3>();
  model::LevelError level;
  level.covariance = tilt_covariance();
  level.pitch_tangent = pitch_tangent(world_Q_vehicle_);
  level.memory = marked_.ldlt().solve(shared.transpose()).transpose();

  level.added = without_negative(level.covariance - level.memory * shared.transpose());
  return level;
}

}  // namespace understory::lidar_imu_input
