#include "services/geoslam_mapper/smoothing/velocity_track.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "common/model/preintegration.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Change of speed within a step of odometry [m/s^2]: the mean speed differs from that at the end.
constexpr double kAcceleration_mps2 = 2.0;
/// Sigma of the velocity of a stationary vehicle [m/s].
constexpr double kStandstill_mps = 0.01;
/// chi^2 with three degrees of freedom that is exceeded once in 10,000.
constexpr double kGate = 21.1;
/// A millimetre, a milliradian: landmarks have errors that all scans of a place share.
constexpr double kLeastVariance = 1e-6;

double square(double value) { return value * value; }

Eigen::Matrix2d isotropic(double sigma) { return square(sigma) * Eigen::Matrix2d::Identity(); }

}  // namespace

/// Starts with odometry's mean velocity, or none; a known bias stays.
void VelocityTrack::start_with(const geometry::SE2WithCovariance& step,
                               const model::InertialMotion& inertial) {
  VelocityState start;
  start.mean.tail<2>() = inertial.inertial.bias.tail<2>();
  start.covariance.bottomRightCorner<2, 2>() = isotropic(model::kUnknownAccelerometerBias_mps2);
  if (now_) {
    start.mean.tail<2>() = now_->mean.tail<2>();
    start.covariance.bottomRightCorner<2, 2>() = now_->covariance.bottomRightCorner<2, 2>();
  }

  start.covariance.topLeftCorner<2, 2>() = isotropic(kStandstill_mps);
  if (!inertial.is_stationary) {
    const double seconds = inertial.inertial.seconds;
    start.mean.head<2>() = step.mean.rotation().transpose() * step.mean.translation() / seconds;
    start.covariance.topLeftCorner<2, 2>() =
        step.covariance.topLeftCorner<2, 2>() / square(seconds) +
        isotropic(kAcceleration_mps2 * seconds);
  }
  now_ = start;
}

/// Updates velocity and bias with odometry's motion in the next step, and the last pose by its
/// correlation with them.
void VelocityTrack::learn_from(const geometry::SE2WithCovariance& step,
                               const model::Preintegration& z,
                               geometry::SE2WithCovariance& map_T_last) {
  Eigen::Matrix<double, 2, 4> jacobian;  // Of the displacement.
  jacobian << z.seconds * Eigen::Matrix2d::Identity(), z.bias_jacobian.block<2, 2>(3, 1);
  const Eigen::Vector2d bias = now_->mean.tail<2>() - z.bias.tail<2>();
  const Eigen::Vector2d expected =
      z.seconds * now_->mean.head<2>() + z.position_m + z.bias_jacobian.block<2, 2>(3, 1) * bias;
  const Eigen::Matrix2d rotation = step.mean.rotation();
  const Eigen::Matrix2d weight =
      (jacobian * now_->covariance * jacobian.transpose() +
       rotation * step.covariance.topLeftCorner<2, 2>() * rotation.transpose() +
       z.covariance.bottomRightCorner<2, 2>())
          .inverse();
  const Eigen::Vector2d error = step.mean.translation() - expected;

  const Eigen::Matrix<double, 3, 2> seen_by_pose = now_->with_pose * jacobian.transpose();
  const Eigen::Matrix<double, 4, 2> seen = now_->covariance * jacobian.transpose();
  map_T_last.mean = map_T_last.mean * geometry::SE2::Exp(seen_by_pose * (weight * error));
  map_T_last.covariance -= seen_by_pose * weight * seen_by_pose.transpose();
  now_->mean += seen * (weight * error);
  now_->with_pose -= seen_by_pose * weight * seen.transpose();
  now_->covariance -= seen * weight * seen.transpose();
}

geometry::SE2WithCovariance VelocityTrack::predict(
    const geometry::SE2WithCovariance& map_T_last, const geometry::SE2WithCovariance& step,
    const std::optional<model::InertialMotion>& inertial) {
  geometry::SE2WithCovariance last{
      map_T_last.mean, map_T_last.covariance + kLeastVariance * Eigen::Matrix3d::Identity()};
  if (!inertial || inertial->is_stationary || !now_) {
    predicted_ = compound(last, step);
    if (inertial) {
      start_with(step, *inertial);
    } else {
      now_.reset();
    }
    return predicted_;
  }

  learn_from(step, inertial->inertial, last);
  carry_on(step, inertial->inertial, last);
  return predicted_;
}

void VelocityTrack::carry_on(const geometry::SE2WithCovariance& step,
                             const model::Preintegration& z,
                             const geometry::SE2WithCovariance& map_T_last) {
  const double t = z.seconds;
  const Eigen::Matrix2d back = step.mean.rotation().transpose();
  const Eigen::Matrix2d velocity_by_bias = z.bias_jacobian.block<2, 2>(1, 1);
  const Eigen::Matrix2d position_by_bias = z.bias_jacobian.block<2, 2>(3, 1);
  const Eigen::Vector2d velocity = now_->mean.head<2>();
  const Eigen::Vector2d bias = now_->mean.tail<2>() - z.bias.tail<2>();

  // The estimates.
  VelocityState next = *now_;
  next.mean.head<2>() = back * (velocity + z.velocity_mps + velocity_by_bias * bias);
  const geometry::SE2 last_T_next(t * velocity + z.position_m + position_by_bias * bias,
                                  step.mean.theta());

  // Propagation of the errors: of the pose, of velocity and bias, and of their correlation.
  const Eigen::Matrix3d carried = last_T_next.inverse().Adjoint();
  Eigen::Matrix4d own = Eigen::Matrix4d::Identity();
  own.topLeftCorner<2, 2>() = back;
  own.topRightCorner<2, 2>() = back * velocity_by_bias;
  Eigen::Matrix<double, 3, 4> in_pose = Eigen::Matrix<double, 3, 4>::Zero();
  in_pose.topLeftCorner<2, 2>() = t * back;
  in_pose.topRightCorner<2, 2>() = back * position_by_bias;

  // The noise of (x, y, theta; velocity, bias); a rotation turns the velocity's axes.
  const Eigen::Vector2d turned = -geometry::perpendicular(next.mean.head<2>());
  const double rotation = step.covariance(2, 2);
  Eigen::Matrix3d pose_noise = Eigen::Matrix3d::Zero();
  pose_noise.topLeftCorner<2, 2>() =
      back * z.covariance.bottomRightCorner<2, 2>() * back.transpose();
  pose_noise(2, 2) = rotation;
  Eigen::Matrix4d noise = Eigen::Matrix4d::Zero();
  noise.topLeftCorner<2, 2>() = back * z.covariance.block<2, 2>(1, 1) * back.transpose() +
                                rotation * turned * turned.transpose();
  noise.diagonal().tail<2>() = model::added_accelerometer_bias(z);

  next.covariance = own * now_->covariance * own.transpose() + noise;
  next.with_pose = (carried * now_->with_pose + in_pose * now_->covariance) * own.transpose();
  next.with_pose.topLeftCorner<2, 2>() += back * z.covariance.block<2, 2>(3, 1) * back.transpose();
  next.with_pose.block<1, 2>(2, 0) += rotation * turned.transpose();

  const Eigen::Matrix3d of_both = carried * now_->with_pose * in_pose.transpose();
  predicted_ = {map_T_last.mean * last_T_next,
                carried * map_T_last.covariance * carried.transpose() + of_both +
                    of_both.transpose() + in_pose * now_->covariance * in_pose.transpose() +
                    pose_noise};
  now_ = next;
}

bool VelocityTrack::update(const geometry::SE2WithCovariance& map_T_scan) {
  if (!now_) return true;
  const Eigen::Vector3d correction = (predicted_.mean.inverse() * map_T_scan.mean).Log();
  const Eigen::Matrix3d learned = predicted_.covariance - map_T_scan.covariance;
  const Eigen::LLT<Eigen::Matrix3d> of_learned(learned);
  if (of_learned.info() != Eigen::Success || correction.dot(of_learned.solve(correction)) > kGate) {
    forget();
    return false;
  }

  // Update of velocity and bias from the pose's correction, by their correlation.
  const Eigen::Matrix<double, 3, 4> gain = predicted_.covariance.llt().solve(now_->with_pose);
  now_->mean += gain.transpose() * correction;
  now_->covariance -= gain.transpose() * learned * gain;
  now_->with_pose = map_T_scan.covariance * gain;
  return true;
}

void VelocityTrack::set_pose() {
  if (now_) now_->with_pose.setZero();
}

}  // namespace understory::geoslam_mapper::smoothing
