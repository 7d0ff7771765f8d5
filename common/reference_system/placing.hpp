// Location of a map on the earth from common points.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/reference_system/reference_system.hpp"

namespace understory::reference_system {

/// A point known in the map and on the earth.
struct CommonPoint {
  Eigen::Vector2d map_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  /// East and north, in the coordinates of Transformation.
  Eigen::Vector2d world = Eigen::Vector2d::Zero();
  /// Sigma of the distance between the two; larger errors have less weight (Huber).
  double sigma_m = 1.0;
};

/// Location of a map.
struct Placing {
  model::MapReference reference;
  std::vector<double> residuals_m;  ///< Distance of each point from its transformed position.
  double rms_m = 0.0;               ///< Root mean square of these.
  double reach_m = 0.0;             ///< Farthest point from the middle of all.
  /// Ratio of distances on the earth to those in the map, assumed to be 1: another value means a
  /// wrong system or unit, or a map that is too large or too small.
  double scale = 1.0;
};

/// The rigid placing of the map with the least sum of squares; errors beyond `sigma_m` count
/// linearly. Throws ReferenceError for fewer than two points, points within 1 m of each other, and
/// the errors of frame_at(). Cost: some ten passes over the points.
Placing place_map(const std::string& system, std::span<const CommonPoint> points);

}  // namespace understory::reference_system
