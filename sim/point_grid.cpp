#include "sim/point_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::sim {

PointGrid::PointGrid(std::span<const Eigen::Vector2d> points_m, double tile_m)
    : points_(points_m.begin(), points_m.end()), tile_m_(tile_m), first_of_tile_(1, 0) {
  if (points_.empty()) return;
  Eigen::Vector2d low = points_.front();
  Eigen::Vector2d high = points_.front();

  for (const Eigen::Vector2d& p : points_) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }

  origin_m_ = low;
  columns_ = static_cast<int>((high.x() - low.x()) / tile_m_) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) / tile_m_) + 1;

  const auto tile_of = [this](const Eigen::Vector2d& p) {
    return static_cast<std::size_t>(row(p.y())) * columns_ + column(p.x());
  };

  first_of_tile_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  for (const Eigen::Vector2d& p : points_) ++first_of_tile_[tile_of(p) + 1];
  for (std::size_t t = 1; t < first_of_tile_.size(); ++t)
    first_of_tile_[t] += first_of_tile_[t - 1];
  std::vector<std::uint32_t> next(first_of_tile_.begin(), first_of_tile_.end() - 1);
  order_.resize(points_.size());
  for (std::uint32_t i = 0; i < points_.size(); ++i) order_[next[tile_of(points_[i])]++] = i;
}

int PointGrid::column(double x_m) const {
  const double tile = std::floor((x_m - origin_m_.x()) / tile_m_);
  return static_cast<int>(std::clamp(tile, 0.0, columns_ - 1.0));
}

int PointGrid::row(double y_m) const {
  const double tile = std::floor((y_m - origin_m_.y()) / tile_m_);
  return static_cast<int>(std::clamp(tile, 0.0, rows_ - 1.0));
}

template <typename Visit>
void PointGrid::visit_within(const Eigen::Vector2d& centre_m, double radius_m, Visit visit) const {
  if (points_.empty()) return;
  const int last_row = row(centre_m.y() + radius_m);
  const int last_column = column(centre_m.x() + radius_m);
  for (int r = row(centre_m.y() - radius_m); r <= last_row; ++r) {
    for (int c = column(centre_m.x() - radius_m); c <= last_column; ++c) {
      const std::size_t tile = static_cast<std::size_t>(r) * columns_ + c;
      for (std::uint32_t k = first_of_tile_[tile]; k < first_of_tile_[tile + 1]; ++k) {
        const double squared = (points_[order_[k]] - centre_m).squaredNorm();
        if (squared <= radius_m * radius_m && !visit(order_[k], squared)) return;
      }
    }
  }
}

std::vector<std::uint32_t> PointGrid::within(const Eigen::Vector2d& centre_m,
                                             double radius_m) const {
  std::vector<std::uint32_t> found;
  visit_within(centre_m, radius_m, [&](std::uint32_t index, double) {
    found.push_back(index);
    return true;
  });
  std::sort(found.begin(), found.end());
  return found;
}

bool PointGrid::any_within(const Eigen::Vector2d& centre_m, double radius_m) const {
  bool any = false;
  visit_within(centre_m, radius_m, [&](std::uint32_t, double) {
    any = true;
    return false;
  });
  return any;
}

std::optional<PointGrid::Neighbour> PointGrid::nearest(const Eigen::Vector2d& centre_m) const {
  if (points_.empty()) return std::nullopt;

  // Far outside the box the search would start with many empty rings; it starts at the box instead.
  const Eigen::Vector2d high = origin_m_ + tile_m_ * Eigen::Vector2d(columns_, rows_);
  const double outside = (centre_m - centre_m.cwiseMax(origin_m_).cwiseMin(high)).norm();
  for (double radius = outside + tile_m_;; radius *= 2.0) {
    Neighbour best{0, std::numeric_limits<double>::infinity()};
    visit_within(centre_m, radius, [&](std::uint32_t index, double squared) {
      const double distance = std::sqrt(squared);
      if (distance < best.distance_m || (distance == best.distance_m && index < best.index)) {
        best = {index, distance};
      }
      return true;
    });
    if (std::isfinite(best.distance_m)) return best;
  }
}

}  // namespace understory::sim
