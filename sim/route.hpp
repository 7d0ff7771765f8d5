// A smooth path through the plane.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "sim/uniform_spline.hpp"

namespace understory::sim {

/// A drivable curve, parametrised by its length: curvature and its derivative are continuous.
class Route {
 public:
  /// Through `waypoints_m`, with corners rounded over about 3 * `rounding_m` (the least radius in a
  /// right angle is then about half of `rounding_m`) and measurement noise smoothed. Straight
  /// beyond its ends. Throws std::runtime_error if the points do not give a path of at least 1 m.
  static Route through(std::span<const Eigen::Vector2d> waypoints_m, double rounding_m);

  /// From end to end.
  double length_m() const { return length_m_; }
  /// A point of the route, frame of the waypoints.
  struct Place {
    Eigen::Vector2d position_m;
    double heading_rad;
    double curvature;  ///< Left positive [1/m].
  };
  /// `along_m` is clamped to the route.
  Place at(double along_m) const;
  /// The place as a pose, x along the route.
  geometry::SE2 pose(double along_m) const;
  /// Places every `spacing_m`, including the end.
  std::vector<Eigen::Vector2d> places(double spacing_m) const;
  /// The route moved by `world_T_route`.
  Route moved(const geometry::SE2& world_T_route) const;

 private:
  UniformSpline<2> curve_;
  double start_ = 0.0;  ///< Parameter at the start of the route: control points extend beyond.
  double length_m_ = 0.0;
};

}  // namespace understory::sim
