#include "common/factor_graph/graph/pose3.hpp"

#include <cmath>

namespace understory::factor_graph::graph {
namespace {

constexpr double kSmallAngle2 = 1e-8;  ///< Squared; series below it.

}  // namespace

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v) {
  const double angle2 = v.squaredNorm();
  if (angle2 < kSmallAngle2) {
    const double scale = 0.5 - angle2 / 48.0;
    return {1.0 - angle2 / 8.0, scale * v.x(), scale * v.y(), scale * v.z()};
  }
  const double angle = std::sqrt(angle2);
  const double scale = std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), scale * v.x(), scale * v.y(), scale * v.z()};
}

Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  if (sine < 1e-8) return 2.0 * sign * q.vec();
  return 2.0 * std::atan2(sine, sign * q.w()) / sine * sign * q.vec();
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& v) {
  const double angle2 = v.squaredNorm();
  const Eigen::Matrix3d m = cross_matrix(v);
  if (angle2 < kSmallAngle2) return Eigen::Matrix3d::Identity() - 0.5 * m + m * m / 6.0;
  const double angle = std::sqrt(angle2);
  const double half_sine = std::sin(0.5 * angle);
  return Eigen::Matrix3d::Identity() - 2.0 * half_sine * half_sine / angle2 * m +
         (angle - std::sin(angle)) / (angle2 * angle) * m * m;
}

}  // namespace understory::factor_graph::graph
