// Covariance to information and back.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace understory::geometry {

/// Inverse of a covariance or of an information (3 x 3): exactly symmetric and positive definite
/// whatever its scales. A motion over a blind way is known to millimetres along one direction and
/// to tens of metres along another: cofactors leave such an inverse asymmetric, or indefinite. Of a
/// singular matrix what is nothing counts as 1e-15 of the largest eigenvalue.
inline Eigen::Matrix3d symmetric_inverse(const Eigen::Matrix3d& matrix) {
  const Eigen::LLT<Eigen::Matrix3d> factor(matrix);
  Eigen::Matrix3d root;  // root' root is the inverse
  if (factor.info() == Eigen::Success) {
    root = factor.matrixL().solve(Eigen::Matrix3d::Identity());
  } else {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
    const double least = 1e-15 * eigen.eigenvalues().cwiseAbs().maxCoeff();
    root = eigen.eigenvalues().cwiseMax(least).cwiseSqrt().cwiseInverse().asDiagonal() *
           eigen.eigenvectors().transpose();
  }
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  inverse.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  return inverse.selfadjointView<Eigen::Lower>();
}

}  // namespace understory::geometry
