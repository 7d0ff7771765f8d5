// The landmarks of one map, for the search of an overlap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/model/map.hpp"

namespace understory::map_merge {

/// A landmark with a covariance that is never zero.
struct UncertainLandmark {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Identity();
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  std::uint32_t index = 0;  ///< Index in the map.

  /// Mean variance per axis [m^2].
  double variance_m2() const { return 0.5 * covariance_m2.trace(); }
};

/// The usable landmarks of a map with a spatial index. Not copyable, because it is large.
class LandmarkSet {
 public:
  /// Leaves out landmarks that are not finite or too far away. `unknown_sigma_m`: sigma of a
  /// landmark without covariance.
  LandmarkSet(std::span<const model::MapLandmark> landmarks, double unknown_sigma_m);

  /// All of them, in order of index.
  const std::vector<UncertainLandmark>& all() const { return landmarks_; }
  /// Grid of positions; slots are indices in all().
  const constellation::PointGrid& grid() const { return grid_; }
  /// Usual distance between neighbours [m]: the side of a square that has one landmark.
  double spacing_m() const { return spacing_m_; }
  /// Number of landmarks within the radius around a point of this map's frame.
  std::size_t count_within(const Eigen::Vector2d& point_m, double radius_m) const;
  /// Indices in all() of the `count` nearest, the nearest first; ties by index.
  std::vector<std::uint32_t> nearest(const Eigen::Vector2d& point_m, std::size_t count) const;

 private:
  double usual_spacing() const;

  std::vector<UncertainLandmark> landmarks_;
  constellation::PointGrid grid_;
  double spacing_m_ = 0.0;
};

}  // namespace understory::map_merge
