#include "eval/harness/block.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::eval::harness {

double block_length_m(const Eigen::Vector2d& straight_m, double corner_m) {
  return 2.0 * straight_m.sum() + 2.0 * std::numbers::pi * corner_m;
}

geometry::SE2 on_block(double along_m, const Eigen::Vector2d& straight_m, double corner_m) {
  const double quarter_m = 0.5 * std::numbers::pi * corner_m;
  geometry::SE2 pose;
  double left_m = std::fmod(along_m, block_length_m(straight_m, corner_m));
  for (int side = 0;; side = (side + 1) % 4) {
    const double side_m = straight_m[side % 2];
    if (left_m <= side_m) return pose * geometry::SE2(left_m, 0.0, 0.0);
    left_m -= side_m;

    const double arc_m = std::min(left_m, quarter_m);
    pose =
        pose * geometry::SE2(side_m, 0.0, 0.0) * geometry::SE2::Exp({arc_m, 0.0, arc_m / corner_m});
    if (left_m <= quarter_m) return pose;
    left_m -= quarter_m;
  }
}

}  // namespace understory::eval::harness
