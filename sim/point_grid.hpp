// A fixed set of points in the plane, sorted into square tiles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace understory::sim {

/// A static index of points; a query looks only into the tiles that it touches.
class PointGrid {
 public:
  /// Tiles of `tile_m` over the bounding box of `points_m`; the points are copied.
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
  /// Calls visit(index, squared distance) for the points of the tiles that touch the disc; stops
  /// when it returns false.
  template <typename Visit>
  void visit_within(const Eigen::Vector2d& centre_m, double radius_m, Visit visit) const;
  int column(double x_m) const;
  int row(double y_m) const;

  std::vector<Eigen::Vector2d> points_;
  double tile_m_ = 1.0;
  Eigen::Vector2d origin_m_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint32_t> first_of_tile_;  ///< columns * rows + 1 offsets into order_.
  std::vector<std::uint32_t> order_;
};

}  // namespace understory::sim
