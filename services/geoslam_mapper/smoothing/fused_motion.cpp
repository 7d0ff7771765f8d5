#include "services/geoslam_mapper/smoothing/fused_motion.hpp"

#include <Eigen/Eigenvalues>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Steps of Gauss-Newton; the motions are near each other.
constexpr int kFusingSteps = 3;
/// Directions with less than this share of the largest information are undetermined.
constexpr double kOpen = 1e-9;
/// Share of a sum's information that is rounding.
constexpr double kRoundedOff = 1e-12;

/// The minimum-norm step if the information leaves directions undetermined.
Eigen::Vector3d least_step(const Eigen::Matrix3d& information, const Eigen::Vector3d& gradient) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  const double least = kOpen * solver.eigenvalues()[2];
  const Eigen::Vector3d inverse = solver.eigenvalues().unaryExpr(
      [&](double value) { return value > least ? 1.0 / value : 0.0; });
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() *
         gradient;
}

/// Tangent vector of `to` in the frame of `from`.
Eigen::Vector3d seen_from(const geometry::SE2& from, const geometry::SE2& to) {
  return (from.inverse() * to).Log();
}

}  // namespace

MeasuredMotion fused(const MeasuredMotion& one, const MeasuredMotion& other) {
  MeasuredMotion result{one.a_T_b, one.information + other.information};
  for (int step = 0; step < kFusingSteps; ++step) {
    const Eigen::Vector3d gradient = one.information * seen_from(result.a_T_b, one.a_T_b) +
                                     other.information * seen_from(result.a_T_b, other.a_T_b);
    result.a_T_b = result.a_T_b * geometry::SE2::Exp(least_step(result.information, gradient));
  }
  return result;
}

MeasuredMotion without(const MeasuredMotion& sum, const MeasuredMotion& part) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum.information - part.information);
  const double least = kRoundedOff * sum.information.trace();
  const Eigen::Vector3d values =
      solver.eigenvalues().unaryExpr([&](double value) { return value > least ? value : 0.0; });

  MeasuredMotion result;
  result.information =
      solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
  result.information = 0.5 * (result.information + result.information.transpose()).eval();
  const Eigen::Vector3d gradient = -part.information * seen_from(sum.a_T_b, part.a_T_b);
  result.a_T_b = sum.a_T_b * geometry::SE2::Exp(least_step(result.information, gradient));
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
