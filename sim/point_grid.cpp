#include "sim/point_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::sim {

PointGrid::PointGrid(std::span<const Eigen::Vector2d> points_m, double tile_m)
    : points_(points_m.begin(), points_m.end()), tile_m_(tile_m), bins_(points_, tile_m) {
  if (points_.empty()) return;
  low_m_ = high_m_ = points_.front();
  for (const Eigen::Vector2d& p : points_) {
    low_m_ = low_m_.cwiseMin(p);
    high_m_ = high_m_.cwiseMax(p);
  }
}

std::vector<std::uint32_t> PointGrid::within(const Eigen::Vector2d& centre_m,
                                             double radius_m) const {
  std::vector<std::uint32_t> found;
  bins_.for_each_within(centre_m, radius_m,
                        [&](std::uint32_t index, double) { found.push_back(index); });
  std::sort(found.begin(), found.end());
  return found;
}

bool PointGrid::any_within(const Eigen::Vector2d& centre_m, double radius_m) const {
  bool any = false;
  bins_.for_each_within(centre_m, radius_m, [&](std::uint32_t, double) { any = true; });
  return any;
}

std::optional<PointGrid::Neighbour> PointGrid::nearest(const Eigen::Vector2d& centre_m) const {
  if (points_.empty()) return std::nullopt;

  // Far outside the box of points the search starts with a radius that reaches the box.
  const double outside = (centre_m - centre_m.cwiseMax(low_m_).cwiseMin(high_m_)).norm();
  for (double radius = outside + tile_m_;; radius *= 2.0) {
    Neighbour best{0, std::numeric_limits<double>::infinity()};
    bins_.for_each_within(centre_m, radius, [&](std::uint32_t index, double squared) {
      const double distance = std::sqrt(squared);
      if (distance < best.distance_m || (distance == best.distance_m && index < best.index)) {
        best = {index, distance};
      }
    });
    if (std::isfinite(best.distance_m)) return best;
  }
}

}  // namespace understory::sim
