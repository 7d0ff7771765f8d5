// One observation, prepared for the search: its triangles, and how well each point is known.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hierarchy/constellation_localisation.hpp"
#include "common/hierarchy/constellation_triangles.hpp"

namespace understory::constellation {

struct PreparedPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double variance = 0.0;  ///< Per axis, of the difference to its landmark: both sides' together.
};

struct PreparedObservation {
  std::vector<PreparedPoint> points;
  std::vector<std::uint32_t> observed;  ///< Index in the observation as given.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius_m = 0.0;        ///< Of a disc with the same second moment.
  double density_per_m2 = 0.0;  ///< Points in that disc.
};

/// Leaves out points that are not finite; a point's sigma counts at least as much as the map's.
PreparedObservation prepare(std::span<const ObservedPoint> points,
                            const LocaliseParameters& parameters);

/// Triangles among each point's nearest neighbours, each once; vertices are indices of prepared
/// points. Those so flat that noise could mirror them are left out.
std::vector<Triangle> triangles_of(const PreparedObservation& observation, int neighbours);

}  // namespace understory::constellation
