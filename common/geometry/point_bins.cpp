#include "common/geometry/point_bins.hpp"

#include <algorithm>

namespace understory::geometry {

PointBins::PointBins(std::span<const Eigen::Vector2d> points, double bin_m) {
  if (points.empty()) return;

  // The extent of the points, and a bin size that keeps the grid small.
  Eigen::Vector2d low = points.front();
  Eigen::Vector2d high = points.front();
  for (const Eigen::Vector2d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector2d extent = high - low;
  const double max_bins = std::max<double>(4096.0, 4.0 * static_cast<double>(points.size()));
  while ((extent.x() / bin_m + 1.0) * (extent.y() / bin_m + 1.0) > max_bins) bin_m *= 2.0;

  origin_ = low;
  inverse_bin_ = 1.0 / bin_m;
  columns_ = static_cast<int>(extent.x() * inverse_bin_) + 1;
  rows_ = static_cast<int>(extent.y() * inverse_bin_) + 1;

  // Counting sort: the number of points per bin, then where each bin starts, then the points.
  std::vector<std::uint32_t> bins(points.size());
  starts_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    bins[i] = static_cast<std::uint32_t>(row(points[i].y()) * columns_ + column(points[i].x()));
    ++starts_[bins[i] + 1];
  }
  for (std::size_t b = 1; b < starts_.size(); ++b) starts_[b] += starts_[b - 1];

  indices_.resize(points.size());
  points_.resize(points.size());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t slot = next[bins[i]]++;
    indices_[slot] = static_cast<std::uint32_t>(i);
    points_[slot] = points[i];
  }
}

}  // namespace understory::geometry
