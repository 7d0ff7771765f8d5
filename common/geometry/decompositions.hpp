// Decompositions of small matrices, instantiated once: each costs seconds wherever it is compiled.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace understory::geometry {

/// Eigenvalues, ascending, and unit eigenvectors, as columns, of a symmetric 2x2 matrix.
struct PrincipalAxes {
  Eigen::Vector2d values;
  Eigen::Matrix2d vectors;
};

/// Of a symmetric 2x2 matrix; only its lower triangle is read. Not finite where the matrix is not.
PrincipalAxes principal_axes(const Eigen::Matrix2d& symmetric);
/// Eigenvalues of a symmetric 2x2 matrix, ascending.
Eigen::Vector2d eigenvalues(const Eigen::Matrix2d& symmetric);
/// Eigenvalues of a symmetric 3x3 matrix, ascending.
Eigen::Vector3d eigenvalues(const Eigen::Matrix3d& symmetric);

/// The shortest rotation that takes the direction `from` to the direction `to`; neither may be
/// zero.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace understory::geometry
