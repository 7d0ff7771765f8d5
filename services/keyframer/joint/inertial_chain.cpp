#include "services/keyframer/joint/inertial_chain.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "common/model/preintegration.hpp"

namespace understory::keyframer::joint {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;

/// Of an unknown velocity [m/s]: keeps the system regular.
constexpr double kAnyVelocity_mps = 1000.0;
/// Of the velocity of a stationary vehicle [m/s].
constexpr double kStandstill_mps = 0.01;
/// Least variance of (yaw, velocity, position): rounding, and unmodelled errors.
const Vector5 kLeastVariance = (Vector5() << 1e-12, 1e-8, 1e-8, 1e-10, 1e-10).finished();
/// Least variance of a combination of these, each in units of its standard deviation. The wire
/// accepts eigenvalues of the correlations down to -1e-6 as rounding.
constexpr double kLeastOfOwn = 4e-6;

/// The error of one step, and its Jacobians.
struct StepError {
  Vector5 value;                              ///< Of (yaw, velocity, position).
  Eigen::Matrix<double, 5, 6> by_poses;       ///< Left perturbations of its two poses.
  Eigen::Matrix<double, 5, 4> by_velocities;  ///< Of its two scans.
  Eigen::Matrix<double, 5, 3> by_bias;
};

StepError error_of(const model::Preintegration& z, const geometry::SE2& a, const geometry::SE2& b,
                   const Eigen::Vector2d& velocity_a, const Eigen::Vector2d& velocity_b) {
  const Eigen::Matrix2d a_R_centre = a.rotation().transpose();
  const Eigen::Vector2d way = b.translation() - a.translation();
  const Eigen::Matrix2d a_R_b = a_R_centre * b.rotation();
  const Eigen::Vector2d end = a_R_b * velocity_b;

  StepError error;
  error.value(0) = geometry::wrap_angle(b.theta() - a.theta() - z.yaw_rad);
  error.value.segment<2>(1) = end - velocity_a - z.velocity_mps;
  error.value.tail<2>() = a_R_centre * way - z.seconds * velocity_a - z.position_m;

  error.by_poses.setZero();
  error.by_poses(0, 2) = -1.0;
  error.by_poses(0, 5) = 1.0;
  error.by_poses.block<2, 1>(1, 2) = -geometry::perpendicular(end);
  error.by_poses.block<2, 1>(1, 5) = geometry::perpendicular(end);
  error.by_poses.block<2, 2>(3, 0) = -a_R_centre;
  error.by_poses.block<2, 1>(3, 2) = -a_R_centre * geometry::perpendicular(b.translation());
  error.by_poses.block<2, 2>(3, 3) = a_R_centre;
  error.by_poses.block<2, 1>(3, 5) = a_R_centre * geometry::perpendicular(b.translation());

  error.by_velocities.setZero();
  error.by_velocities.block<2, 2>(1, 0) = -Eigen::Matrix2d::Identity();
  error.by_velocities.block<2, 2>(1, 2) = a_R_b;
  error.by_velocities.block<2, 2>(3, 0) = -z.seconds * Eigen::Matrix2d::Identity();
  error.by_bias = -z.bias_jacobian;
  return error;
}

}  // namespace

std::optional<Matrix5> inertial_information(const Matrix5& covariance) {
  if (!covariance.allFinite() || (covariance.diagonal().array() < 0.0).any()) return std::nullopt;
  const Vector5 scale = (covariance.diagonal() + kLeastVariance).cwiseSqrt().cwiseInverse();
  Matrix5 scaled =
      scale.asDiagonal() * (covariance + Matrix5(kLeastVariance.asDiagonal())) * scale.asDiagonal();
  scaled.diagonal().array() += kLeastOfOwn;
  const Eigen::LLT<Matrix5> factor(scaled);
  if (factor.info() != Eigen::Success) return std::nullopt;

  const Matrix5 root = factor.matrixL().solve(Matrix5(scale.asDiagonal()));  // root' root
  Matrix5 information = Matrix5::Zero();
  information.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  return Matrix5(information.selfadjointView<Eigen::Lower>());
}

InertialChain::InertialChain(std::span<const std::optional<model::InertialMotion>> steps,
                             const BiasEstimate& prior)
    : poses_(steps.size() + 1), prior_(prior) {
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const auto information =
        steps[k] ? inertial_information(steps[k]->inertial.covariance) : std::nullopt;
    if (!information) continue;
    steps_.push_back({k, *steps[k], *information});
    steps_.back().motion.inertial = at_bias(steps[k]->inertial, prior.mean);
    degrees_of_freedom_ += steps[k]->is_stationary ? 4 : 5;
  }
  degrees_of_freedom_ -= static_cast<int>(2 * poses_);
}

void InertialChain::add_to(std::span<const geometry::SE2> poses, Eigen::MatrixXd& hessian,
                           Eigen::VectorXd& gradient) {
  // The velocities and the bias enter the errors linearly: one step from zero finds the optimum.
  value_ = Eigen::VectorXd::Zero(unknowns());
  Eigen::MatrixXd unused_hessian = Eigen::MatrixXd::Zero(hessian.rows(), hessian.cols());
  Eigen::VectorXd unused_gradient = Eigen::VectorXd::Zero(gradient.size());
  linearise(poses, unused_hessian, unused_gradient);
  value_ = -(hessian_.ldlt().solve(gradient_));

  linearise(poses, hessian, gradient);
  covariance_ = hessian_.ldlt().solve(Eigen::MatrixXd::Identity(unknowns(), unknowns()));
  const Eigen::MatrixXd scaled = coupling_ * covariance_;
  hessian -= scaled * coupling_.transpose();
  gradient -= scaled * gradient_;
}

/// The whole system at `value_`; the poses' part is added to `hessian` and `gradient`.
void InertialChain::linearise(std::span<const geometry::SE2> poses, Eigen::MatrixXd& hessian,
                              Eigen::VectorXd& gradient) {
  hessian_ =
      Eigen::MatrixXd::Identity(unknowns(), unknowns()) / (kAnyVelocity_mps * kAnyVelocity_mps);
  gradient_ = Eigen::VectorXd::Zero(unknowns());
  coupling_ = Eigen::MatrixXd::Zero(hessian.rows(), unknowns());

  const Eigen::Vector3d bias = value_.tail<3>();
  const Eigen::Matrix3d known = prior_.covariance.inverse();
  hessian_.bottomRightCorner<3, 3>() = known;
  gradient_.tail<3>() = known * bias;
  chi2_ = bias.dot(known * bias);

  for (const Step& step : steps_) {
    if (step.motion.is_stationary) {
      add_standstill(step);
    } else {
      add(step, poses, hessian, gradient);
    }
  }
}

void InertialChain::add(const Step& step, std::span<const geometry::SE2> poses,
                        Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) {
  const auto pose = static_cast<Eigen::Index>(3 * step.from);
  const auto velocity = static_cast<Eigen::Index>(2 * step.from);
  const Eigen::Index bias = unknowns() - 3;
  StepError error = error_of(step.motion.inertial, poses[step.from], poses[step.from + 1],
                             value_.segment<2>(velocity), value_.segment<2>(velocity + 2));
  error.value += error.by_bias * value_.tail<3>();

  const Eigen::Matrix<double, 6, 5> of_poses = error.by_poses.transpose() * step.information;
  const Eigen::Matrix<double, 4, 5> of_velocities =
      error.by_velocities.transpose() * step.information;
  const Eigen::Matrix<double, 3, 5> of_bias = error.by_bias.transpose() * step.information;

  hessian.block<6, 6>(pose, pose) += of_poses * error.by_poses;
  gradient.segment<6>(pose) += of_poses * error.value;
  coupling_.block<6, 4>(pose, velocity) += of_poses * error.by_velocities;
  coupling_.block<6, 3>(pose, bias) += of_poses * error.by_bias;

  hessian_.block<4, 4>(velocity, velocity) += of_velocities * error.by_velocities;
  hessian_.block<4, 3>(velocity, bias) += of_velocities * error.by_bias;
  hessian_.block<3, 4>(bias, velocity) += of_bias * error.by_velocities;
  hessian_.block<3, 3>(bias, bias) += of_bias * error.by_bias;
  gradient_.segment<4>(velocity) += of_velocities * error.value;
  gradient_.segment<3>(bias) += of_bias * error.value;
  chi2_ += error.value.dot(step.information * error.value);
}

/// A stationary vehicle: its velocity is zero. Odometry holds its pose.
void InertialChain::add_standstill(const Step& step) {
  const auto velocity = static_cast<Eigen::Index>(2 * step.from);
  constexpr double kInformation = 1.0 / (kStandstill_mps * kStandstill_mps);
  hessian_.diagonal().segment<4>(velocity).array() += kInformation;
  gradient_.segment<4>(velocity) += kInformation * value_.segment<4>(velocity);
  chi2_ += kInformation * value_.segment<4>(velocity).squaredNorm();
}

BiasEstimate InertialChain::bias(const Eigen::MatrixXd& root) const {
  const Eigen::MatrixXd by_poses =
      root * coupling_ *
      covariance_.rightCols<3>();  // Covariance of the bias with the poses' own errors.
  return {prior_.mean + value_.tail<3>(),
          covariance_.bottomRightCorner<3, 3>() + by_poses.transpose() * by_poses};
}

}  // namespace understory::keyframer::joint
