#include "common/geometry/alignment.hpp"

#include <cassert>
#include <cmath>

namespace understory::geometry {

void RigidAlignment2::add(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double weight) {
  weight_ += weight;
  sum_a_ += weight * a;
  sum_b_ += weight * b;
  sum_dot_ += weight * a.dot(b);
  sum_cross_ += weight * (b.x() * a.y() - b.y() * a.x());
}

SE2 RigidAlignment2::a_T_b() const {
  if (weight_ <= 0.0) return {};

  const Eigen::Vector2d mean_a = sum_a_ / weight_;
  const Eigen::Vector2d mean_b = sum_b_ / weight_;
  const double dot = sum_dot_ - weight_ * mean_a.dot(mean_b);
  const double cross = sum_cross_ - weight_ * (mean_b.x() * mean_a.y() - mean_b.y() * mean_a.x());
  const double theta = (dot == 0.0 && cross == 0.0) ? 0.0 : std::atan2(cross, dot);
  const SE2 rotation(0.0, 0.0, theta);
  return {mean_a - rotation * mean_b, theta};
}

SE2 align_rigid(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b) {
  assert(a.size() == b.size());
  RigidAlignment2 sums;
  for (std::size_t i = 0; i < a.size(); ++i) sums.add(a[i], b[i]);
  return sums.a_T_b();
}

}  // namespace understory::geometry
