#include "common/geometry/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace understory::geometry {

PrincipalAxes principal_axes(const Eigen::Matrix2d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::Vector2d eigenvalues(const Eigen::Matrix2d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

Eigen::Vector3d eigenvalues(const Eigen::Matrix3d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

Eigen::Matrix3d symmetric_inverse(const Eigen::Matrix3d& matrix) {
  Eigen::Matrix3d root;  // root' root is the inverse
  const Eigen::LLT<Eigen::Matrix3d> factor(matrix);
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

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace understory::geometry
