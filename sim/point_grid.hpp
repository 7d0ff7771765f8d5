// Nearest and within-radius queries in a fixed set of points in the plane.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/point_bins.hpp"

namespace understory::sim {

/// A static index of points. Results do not depend on the size of the tiles: indices are ascending,
/// equal distances are ordered by index.
class PointGrid {
 public:
  /// Tiles of `tile_m` over the bounding box of `points_m`; the points are copied. Fastest if
  /// `tile_m` is about the usual radius of a query.
  PointGrid(std::span<const Eigen::Vector2d> points_m, double tile_m);

  /// A point found and its distance.
  struct Neighbour {
    std::uint32_t index = 0;
    double distance_m = 0.0;
  };
  /// Indices of all points with distance <= radius_m to `centre_m`, ascending.
  std::vector<std::uint32_t> within(const Eigen::Vector2d& centre_m, double radius_m) const;
  /// True if a point has distance <= radius_m to `centre_m`.
  bool any_within(const Eigen::Vector2d& centre_m, double radius_m) const;
  /// The nearest point (the lowest index among equals); none if there are no points.
  std::optional<Neighbour> nearest(const Eigen::Vector2d& centre_m) const;

  /// The points as given.
  std::span<const Eigen::Vector2d> points() const { return points_; }

 private:
  std::vector<Eigen::Vector2d> points_;
  double tile_m_;
  Eigen::Vector2d low_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d high_m_ = Eigen::Vector2d::Zero();
  geometry::PointBins bins_;
};

}  // namespace understory::sim
