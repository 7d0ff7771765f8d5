// The place of a map on the earth from points that are known in both.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/reference_system/reference_system.hpp"

namespace understory::reference_system {

/// A point of the map that is known on the earth.
struct CommonPoint {
  Eigen::Vector2d map_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  Eigen::Vector2d world = Eigen::Vector2d::Zero();  ///< East and north, as Transformation has them.
  double sigma_m = 1.0;  ///< Of the distance between the two; errors beyond count less (Huber).
};

/// Where a map lies.
struct Placing {
  model::MapReference reference;
  std::vector<double> residuals_m;  ///< Distance of each point from where it would be.
  double rms_m = 0.0;               ///< Root mean square of these.
  double reach_m = 0.0;             ///< Farthest point from the middle of all.
  /// Distances on the earth over those of the map, which the placing takes for 1: another value
  /// tells of a wrong system or unit, or of a map that is too large or too small.
  double scale = 1.0;
};

/// The rigid placing of the map with the least sum of squares, errors beyond `sigma_m` by their
/// distance. Throws ReferenceError for fewer than two points, points that lie within 1 m of each
/// other, and what frame_at() refuses. Cost: some ten passes over the points.
Placing place_map(const std::string& system, std::span<const CommonPoint> points);

}  // namespace understory::reference_system
