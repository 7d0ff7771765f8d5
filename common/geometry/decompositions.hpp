// Decompositions of small matrices, instantiated once: each instantiation costs seconds of compile
// time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace understory::geometry {

/// Eigenvalues, ascending, and unit eigenvectors, as columns, of a symmetric 2x2 matrix.
struct PrincipalAxes {
  Eigen::Vector2d values;
  Eigen::Matrix2d vectors;
};

/// Principal axes of a symmetric 2x2 matrix; only its lower triangle is read. The result is not
/// finite where the matrix is not.
PrincipalAxes principal_axes(const Eigen::Matrix2d& symmetric);
/// Eigenvalues of a symmetric 2x2 matrix, ascending.
Eigen::Vector2d eigenvalues(const Eigen::Matrix2d& symmetric);
/// Eigenvalues of a symmetric 3x3 matrix, ascending.
Eigen::Vector3d eigenvalues(const Eigen::Matrix3d& symmetric);
/// Inverse of a covariance or of an information: exactly symmetric and positive definite whatever
/// its scales. A motion without landmarks can have a sigma of millimetres in one direction and of
/// tens of metres in another: an inverse by cofactors is then asymmetric or indefinite. Zero
/// eigenvalues of a singular matrix count as 1e-15 of the largest one.
Eigen::Matrix3d symmetric_inverse(const Eigen::Matrix3d& matrix);

/// The shortest rotation that takes the direction `from` to the direction `to`; neither may be
/// zero.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace understory::geometry
