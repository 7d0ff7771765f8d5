#include "common/geometry/point_rows.hpp"

#include <cmath>
#include <limits>
#include <numeric>

namespace understory::geometry {
namespace {

constexpr double kLastBin = 1e9;

}  // namespace

std::int32_t PointRows::bin(double offset_m) const {
  return static_cast<std::int32_t>(std::clamp(offset_m * inverse_bin_, 0.0, kLastBin));
}

PointRows::PointRows(std::span<const Eigen::Vector2d> points, double bin_m)
    : inverse_bin_(1.0 / bin_m) {
  if (points.empty()) return;
  origin_ = points.front();
  for (const Eigen::Vector2d& point : points) origin_ = origin_.cwiseMin(point);

  // Sort by row, column and index.
  std::vector<std::uint64_t> place(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d offset = points[i] - origin_;
    place[i] = (static_cast<std::uint64_t>(bin(offset.y())) << 32U) |
               static_cast<std::uint64_t>(bin(offset.x()));
  }
  indices_.resize(points.size());
  std::iota(indices_.begin(), indices_.end(), 0U);
  std::ranges::sort(indices_, [&](std::uint32_t a, std::uint32_t b) {
    return place[a] != place[b] ? place[a] < place[b] : a < b;
  });

  // Find the begin of each row.
  for (const std::uint32_t i : indices_) {
    const auto row = static_cast<std::int32_t>(place[i] >> 32U);
    if (rows_.empty() || rows_.back().number != row) {
      rows_.push_back({row, static_cast<std::uint32_t>(points_.size())});
    }
    columns_.push_back(static_cast<std::int32_t>(place[i] & 0xFFFFFFFFU));
    points_.push_back(points[i]);
  }
  rows_.push_back(
      {std::numeric_limits<std::int32_t>::max(), static_cast<std::uint32_t>(points_.size())});
}

std::size_t PointRows::count_around(const Eigen::Vector2d& centre, double radius_m) const {
  std::size_t count = 0;
  for_each_span(centre, radius_m,
                [&](std::size_t begin, std::size_t end) { count += end - begin; });
  return count;
}

}  // namespace understory::geometry
