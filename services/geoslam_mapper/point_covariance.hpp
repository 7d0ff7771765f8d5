// Covariance of a point that follows from the uncertainty of a frame.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper {

/// Covariance [m^2] of a point that is fixed in frame b, in the axes of frame a. `in_b` [m].
inline Eigen::Matrix2d point_covariance(const geometry::SE2WithCovariance& a_T_b,
                                        const Eigen::Vector2d& in_b) {
  Eigen::Matrix<double, 2, 3> jacobian;  // d(point)/d(xi), in the axes of b
  jacobian << 1.0, 0.0, -in_b.y(), 0.0, 1.0, in_b.x();
  const Eigen::Matrix2d rotation = a_T_b.mean.rotation();
  return rotation * jacobian * a_T_b.covariance * jacobian.transpose() * rotation.transpose();
}

}  // namespace understory::geoslam_mapper
