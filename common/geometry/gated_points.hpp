// Points with variances, and a query for the points inside a gate, at bounded cost.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/geometry/point_rows.hpp"

namespace understory::geometry {

/// A set of points, each with a variance. Points of large variance ("vague") are stored apart, so
/// that they do not widen the search for the others. If more than kCrowd points lie around a gate,
/// the query returns none: the pair would be arbitrary.
class GatedPoints {
 public:
  /// More points than any scene has around a gate.
  static constexpr std::size_t kCrowd = 128;

  /// An empty set. Bins of side `bin_m` [m]; a point with a variance above `vague_m2` is vague.
  explicit GatedPoints(double bin_m = 1.0, double vague_m2 = 1.0)
      : bin_m_(bin_m), vague_m2_(vague_m2) {}

  /// Adds the point with the next index, from 0.
  void add(const Eigen::Vector2d& position_m, double variance_m2) {
    Tier& tier = tiers_[variance_m2 > vague_m2_ ? 1 : 0];
    tier.indices.push_back(count_++);
    tier.positions.push_back(position_m);
    tier.max_variance_m2 = std::max(tier.max_variance_m2, variance_m2);
  }
  /// Call it after the last add() and before the first query. O(n log n).
  void sort() {
    for (Tier& tier : tiers_) tier.rows = PointRows(tier.positions, bin_m_);
  }

  /// Calls f(index, squared distance [m^2]) for all points within `sigmas` of `base_m2` and their
  /// own variance, and for some others. At most 2 kCrowd calls.
  template <class F>
  void for_each_near(const Eigen::Vector2d& point, double sigmas, double base_m2, F&& f) const {
    for (const Tier& tier : tiers_) {
      if (tier.indices.empty()) continue;
      const double reach = sigmas * std::sqrt(base_m2 + tier.max_variance_m2);
      const bool is_small = tier.indices.size() <= kCrowd;
      if (!is_small && tier.rows.count_around(point, reach) > kCrowd) continue;
      tier.rows.for_each_within(point, reach,
                                [&](std::uint32_t k, double d2) { f(tier.indices[k], d2); });
    }
  }

 private:
  struct Tier {
    std::vector<std::uint32_t> indices;
    std::vector<Eigen::Vector2d> positions;
    PointRows rows;
    double max_variance_m2 = 0.0;
  };

  double bin_m_;
  double vague_m2_;
  std::uint32_t count_ = 0;
  std::array<Tier, 2> tiers_;
};

}  // namespace understory::geometry
