// Points of the plane sorted into square bins, for many range queries on one fixed set.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::geometry {

/// A counting-sort grid over a fixed set of points, which it copies. Building costs O(n + bins).
class PointBins {
 public:
  /// An empty set: no query finds anything.
  PointBins() = default;
  /// Sorts `points` [m] into bins of side `bin_m`. The side is doubled until the grid has at most
  /// 4 bins per point (or 4096 bins).
  PointBins(std::span<const Eigen::Vector2d> points, double bin_m);

  /// Calls f(index, squared distance [m^2]) for every point within `radius_m` of `centre`, bin by
  /// bin. Cost: the points in the bins that the square around the circle touches.
  template <typename F>
  void for_each_within(const Eigen::Vector2d& centre, double radius_m, F&& f) const {
    if (points_.empty()) return;
    const int x0 = column(centre.x() - radius_m), x1 = column(centre.x() + radius_m);
    const int y0 = row(centre.y() - radius_m), y1 = row(centre.y() + radius_m);
    const double limit = radius_m * radius_m;
    for (int y = y0; y <= y1; ++y) {
      const std::uint32_t begin = starts_[y * columns_ + x0];
      const std::uint32_t end = starts_[y * columns_ + x1 + 1];
      for (std::uint32_t k = begin; k < end; ++k) {
        const double d2 = (points_[k] - centre).squaredNorm();
        if (d2 <= limit) f(indices_[k], d2);
      }
    }
  }

 private:
  int column(double x) const { return clamped((x - origin_.x()) * inverse_bin_, columns_); }
  int row(double y) const { return clamped((y - origin_.y()) * inverse_bin_, rows_); }
  static int clamped(double value, int count) {
    return value <= 0.0 ? 0 : (value >= count ? count - 1 : static_cast<int>(value));
  }

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double inverse_bin_ = 1.0;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> indices_;
  std::vector<Eigen::Vector2d> points_;  ///< Sorted by bin.
};

}  // namespace understory::geometry
