// What a laser that sweeps a plane sees of trunks and walls.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/model/planar_scan.hpp"

namespace understory::test {

struct Circle {
  Eigen::Vector2d centre;
  double radius = 0.0;
};

struct Wall {
  Eigen::Vector2d from;
  Eigen::Vector2d to;
};

inline double hit(const Circle& circle, const Eigen::Vector2d& direction) {
  const double along = circle.centre.dot(direction);
  const double miss2 = circle.centre.squaredNorm() - along * along;
  const double inside = circle.radius * circle.radius - miss2;
  return along > 0.0 && inside > 0.0 ? along - std::sqrt(inside)
                                     : std::numeric_limits<double>::infinity();
}

inline double hit(const Wall& wall, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d along = wall.to - wall.from;
  const double det = direction.x() * along.y() - direction.y() * along.x();
  if (std::abs(det) < 1e-12) return std::numeric_limits<double>::infinity();
  const double range = (wall.from.x() * along.y() - wall.from.y() * along.x()) / det;
  const double part = (wall.from.x() * direction.y() - wall.from.y() * direction.x()) / det;
  return range > 0.0 && part >= 0.0 && part <= 1.0 ? range
                                                   : std::numeric_limits<double>::infinity();
}

/// What a SICK-like laser (361 beams over 180 degrees) sees, with range noise.
inline model::PlanarScan sweep(const std::vector<Circle>& circles, const std::vector<Wall>& walls,
                               double sigma, std::mt19937_64& random) {
  model::PlanarScan scan;
  scan.first_bearing_rad = -0.5 * std::numbers::pi;
  scan.bearing_step_rad = std::numbers::pi / 360.0;
  scan.max_range_m = 80.0;
  std::normal_distribution<double> noise(0.0, sigma);
  for (std::size_t beam = 0; beam < 361; ++beam) {
    const Eigen::Vector2d direction(std::cos(scan.bearing(beam)), std::sin(scan.bearing(beam)));
    double range = 81.91;
    for (const Circle& circle : circles) range = std::min(range, hit(circle, direction));
    for (const Wall& wall : walls) range = std::min(range, hit(wall, direction));
    scan.ranges_m.push_back(static_cast<float>(range < 80.0 ? range + noise(random) : 81.91));
  }
  return scan;
}

inline Circle circle_at(double range, double bearing, double radius) {
  return {range * Eigen::Vector2d(std::cos(bearing), std::sin(bearing)), radius};
}

}  // namespace understory::test
