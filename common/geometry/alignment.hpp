// Closed-form rigid alignment of paired points in the plane.
#pragma once

#include <span>

#include "common/geometry/se2.hpp"

namespace understory::geometry {

/// Weighted sums over point pairs, from which the best rigid motion follows in closed form (Umeyama
/// 1991 without scale). Pairs can be added and removed one by one; each change costs a dozen flops.
class RigidAlignment2 {
 public:
  /// Adds the pair `a` ~ a_T_b * `b` [m]. The weight is an inverse variance or any number in
  /// proportion to it; a negative weight removes an earlier pair.
  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double weight = 1.0);
  /// Sum of the weights.
  double weight() const { return weight_; }
  /// The motion a_T_b with the least weighted squared distance. With fewer than two distinct pairs
  /// only the translation is determined and the heading is zero; without pairs it is the identity.
  SE2 a_T_b() const;

 private:
  double weight_ = 0.0;
  Eigen::Vector2d sum_a_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d sum_b_ = Eigen::Vector2d::Zero();
  double sum_dot_ = 0.0;
  double sum_cross_ = 0.0;
};

/// Best rigid motion a_T_b for equally weighted pairs a[i] ~ a_T_b * b[i]. Precondition: a.size()
/// == b.size().
SE2 align_rigid(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b);

}  // namespace understory::geometry
