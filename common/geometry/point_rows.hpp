// Points of the plane in rows of square bins, for range queries of bounded cost.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::geometry {

/// As PointBins, but with bins of one size however far apart the points are: a single distant point
/// makes no bin larger. Copies the points. Building costs O(n log n).
class PointRows {
 public:
  /// An empty set: no query finds anything.
  PointRows() = default;
  /// Sorts `points` [m] into bins of side `bin_m` that begin at the lowest coordinates.
  PointRows(std::span<const Eigen::Vector2d> points, double bin_m);

  /// Number of points in the bins that the square around the circle touches: the points that
  /// for_each_within() tests. O(rows of these bins * log(n)).
  std::size_t count_around(const Eigen::Vector2d& centre, double radius_m) const;

  /// Calls f(index, squared distance [m^2]) for every point within `radius_m` of `centre`, row by
  /// row of bins, in a row bin by bin, in a bin in order of index. Cost: count_around(), and O(1)
  /// for each point that it counts.
  template <typename F>
  void for_each_within(const Eigen::Vector2d& centre, double radius_m, F&& f) const {
    const double limit = radius_m * radius_m;
    for_each_span(centre, radius_m, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const double d2 = (points_[k] - centre).squaredNorm();
        if (d2 <= limit) f(indices_[k], d2);
      }
    });
  }

 private:
  struct Row {
    std::int32_t number = 0;
    std::uint32_t begin = 0;  ///< Index of its first point; the row ends where the next one begins.
  };

  std::int32_t bin(double offset_m) const;

  template <typename F>
  void for_each_span(const Eigen::Vector2d& centre, double radius_m, F&& f) const {
    if (points_.empty()) return;
    const Eigen::Vector2d offset = centre - origin_;
    const std::int32_t last_row = bin(offset.y() + radius_m);
    const std::int32_t first_column = bin(offset.x() - radius_m);
    const std::int32_t last_column = bin(offset.x() + radius_m);

    // The last row is empty: it only marks the end of the row before it.
    auto row = std::ranges::lower_bound(rows_, bin(offset.y() - radius_m), {}, &Row::number);
    for (; row + 1 < rows_.end() && row->number <= last_row; ++row) {
      const auto begin = columns_.begin() + row->begin;
      const auto end = columns_.begin() + (row + 1)->begin;
      const auto first = std::lower_bound(begin, end, first_column);
      const auto behind = std::upper_bound(first, end, last_column);
      f(static_cast<std::size_t>(first - columns_.begin()),
        static_cast<std::size_t>(behind - columns_.begin()));
    }
  }

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double inverse_bin_ = 1.0;
  std::vector<Row> rows_;              ///< Rows with points, ascending, and one end marker.
  std::vector<std::int32_t> columns_;  ///< Column of each point, in the order of `points_`.
  std::vector<std::uint32_t> indices_;
  std::vector<Eigen::Vector2d> points_;
};

}  // namespace understory::geometry
