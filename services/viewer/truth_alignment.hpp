// Alignment of ground truth with a map in an unknown frame.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "common/geometry/se2.hpp"

namespace understory::viewer {

/// The rigid motion that maps the map's poses to the true ones with the least sum of squares, over
/// all pairs so far (Umeyama 1991, without scale). O(1) per pair.
class TruthAlignment {
 public:
  /// Adds a pair of positions [m] at one time.
  void add(const Eigen::Vector2d& in_map_m, const Eigen::Vector2d& in_world_m);
  /// Removes all pairs.
  void clear() { *this = {}; }
  /// world_T_map; none until the pairs extend over more than 1 m.
  std::optional<geometry::SE2> world_T_map() const;

 private:
  std::size_t pairs_ = 0;
  Eigen::Vector2d mean_map_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_world_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d moment_ = Eigen::Matrix2d::Zero();  ///< Sum of map * world^T about the means.
  double spread_ = 0.0;                               ///< Sum of squares about the map's mean.
};

}  // namespace understory::viewer
