#include "services/geoslam_mapper/smoothing/velocity_track.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Of the accelerometer's bias, the level's error included [m/s^2].
constexpr double kAccelerometer_mps2 = 0.05;
/// Change of speed within a step of odometry [m/s^2]: its mean is not the speed at its end.
constexpr double kAcceleration_mps2 = 2.0;
/// Of the velocity of a stationary vehicle [m/s].
constexpr double kStandstill_mps = 0.01;
/// chi^2 with three degrees of freedom that one in 10,000 exceeds.
constexpr double kGate = 21.1;
/// A millimetre, a milliradian: landmarks have errors that all scans of a place share.
constexpr double kLeastVariance = 1e-6;

double square(double value) { return value * value; }

Eigen::Matrix2d isotropic(double sigma) { return square(sigma) * Eigen::Matrix2d::Identity(); }

}  // namespace

/// Odometry's mean velocity, or none.
void VelocityTrack::start_with(const geometry::SE2WithCovariance& step,
                               const model::InertialMotion& inertial) {
  now_.emplace();
  now_->covariance = isotropic(kStandstill_mps);
  if (inertial.is_stationary) return;
  const double seconds = inertial.inertial.seconds;
  now_->velocity_mps = step.mean.rotation().transpose() * step.mean.translation() / seconds;
  now_->covariance = step.covariance.topLeftCorner<2, 2>() / square(seconds) +
                     isotropic(kAcceleration_mps2 * seconds);
}

/// The velocity at the last scan by what odometry says of the step from it, and the last pose by
/// what their errors have in common.
void VelocityTrack::learn_from(const geometry::SE2WithCovariance& step,
                               const model::Preintegration& z,
                               geometry::SE2WithCovariance& map_T_last) {
  const double t = z.seconds;
  const Eigen::Matrix2d rotation = step.mean.rotation();
  const Eigen::Matrix2d measured =
      (rotation * step.covariance.topLeftCorner<2, 2>() * rotation.transpose() +
       z.covariance.bottomRightCorner<2, 2>()) /
      square(t);
  const Eigen::Vector2d error = (step.mean.translation() - z.position_m) / t - now_->velocity_mps;
  const Eigen::Matrix2d weight = (now_->covariance + measured).inverse();

  const Eigen::Matrix<double, 3, 2> of_pose = now_->with_pose * weight;
  map_T_last.mean = map_T_last.mean * geometry::SE2::Exp(of_pose * error);
  map_T_last.covariance -= of_pose * now_->with_pose.transpose();
  const Eigen::Matrix2d of_velocity = now_->covariance * weight;
  now_->velocity_mps += of_velocity * error;
  now_->with_pose -= of_pose * now_->covariance;
  now_->covariance -= of_velocity * now_->covariance;
}

geometry::SE2WithCovariance VelocityTrack::predict(
    const geometry::SE2WithCovariance& map_T_last, const geometry::SE2WithCovariance& step,
    const std::optional<model::InertialMotion>& inertial) {
  geometry::SE2WithCovariance last{
      map_T_last.mean, map_T_last.covariance + kLeastVariance * Eigen::Matrix3d::Identity()};
  if (!inertial || inertial->is_stationary || !now_) {
    predicted_ = compound(last, step);
    now_.reset();
    if (inertial) start_with(step, *inertial);
    return predicted_;
  }

  const model::Preintegration& z = inertial->inertial;
  learn_from(step, z, last);

  // The pose.
  const double t = z.seconds;
  const Eigen::Matrix2d back = step.mean.rotation().transpose();
  const geometry::SE2 last_T_next(t * now_->velocity_mps + z.position_m, step.mean.theta());
  const Eigen::Matrix3d carried = last_T_next.inverse().Adjoint();
  Eigen::Matrix<double, 3, 2> by_velocity = Eigen::Matrix<double, 3, 2>::Zero();
  by_velocity.topRows<2>() = t * back;
  const double bias = square(kAccelerometer_mps2);
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  noise.topLeftCorner<2, 2>() = back * z.covariance.bottomRightCorner<2, 2>() * back.transpose() +
                                0.25 * bias * square(t * t) * Eigen::Matrix2d::Identity();
  noise(2, 2) = step.covariance(2, 2);

  // The velocity, and what their errors have in common.
  State next;
  next.velocity_mps = back * (now_->velocity_mps + z.velocity_mps);
  const Eigen::Vector2d turned = -geometry::perpendicular(next.velocity_mps);
  next.covariance = back * (now_->covariance + z.covariance.block<2, 2>(1, 1)) * back.transpose() +
                    noise(2, 2) * turned * turned.transpose() + isotropic(kAccelerometer_mps2 * t);
  next.with_pose = carried * now_->with_pose * back.transpose() +
                   by_velocity * now_->covariance * back.transpose();
  next.with_pose.topRows<2>() += back * z.covariance.block<2, 2>(3, 1) * back.transpose() +
                                 0.5 * bias * t * square(t) * Eigen::Matrix2d::Identity();
  next.with_pose.row(2) += noise(2, 2) * turned.transpose();

  const Eigen::Matrix3d of_both = carried * now_->with_pose * by_velocity.transpose();
  predicted_ = {last.mean * last_T_next,
                carried * last.covariance * carried.transpose() + of_both + of_both.transpose() +
                    by_velocity * now_->covariance * by_velocity.transpose() + noise};
  now_ = next;
  return predicted_;
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

  // What the pose's correction tells of the velocity, by what their errors had in common.
  const Eigen::Matrix<double, 3, 2> gain = predicted_.covariance.llt().solve(now_->with_pose);
  now_->velocity_mps += gain.transpose() * correction;
  now_->covariance -= gain.transpose() * learned * gain;
  now_->with_pose = map_T_scan.covariance * gain;
  return true;
}

void VelocityTrack::set_pose() {
  if (now_) now_->with_pose.setZero();
}

}  // namespace understory::geoslam_mapper::smoothing
