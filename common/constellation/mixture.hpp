// Likelihood of all points of an observation at a pose, without association of points to landmarks.
#pragma once

#include <cstdint>

#include "common/constellation/grid.hpp"
#include "common/constellation/observation.hpp"
#include "common/geometry/se2.hpp"

namespace understory::constellation {

/// The model: with probability 1 - `share` a point belongs to no landmark and is uniformly
/// distributed; otherwise it belongs to one of the landmarks around it, `density` of them per
/// square metre.
struct Mixture {
  double share = 0.9;
  double density_per_m2 = 0.01;
};

/// Variance of the pose during the search; it is added to each point's noise. About `centre`, frame
/// `sensor`.
struct Spread {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double translation_variance = 0.0;  ///< [m^2] Per axis.
  double rotation_variance = 0.0;     ///< [rad^2]
};

/// The mixture at one pose. Tangent order, right perturbation.
struct MixtureAt {
  double log_likelihood = 0.0;  ///< Natural logarithm, relative to uniformly distributed points.
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  /// Information on the pose if each point's landmark were known.
  Eigen::Matrix3d complete = Eigen::Matrix3d::Zero();
  /// Information lost because it is not known (Louis 1982).
  Eigen::Matrix3d missing = Eigen::Matrix3d::Zero();
  std::uint32_t lookups = 0;  ///< Points looked up in the map.

  /// Information of the observation on the pose.
  Eigen::Matrix3d information() const { return complete - missing; }
};

/// Precondition: share < 1. O(points * landmarks within about 5 sigmas).
MixtureAt evaluate(const PreparedObservation& observation, const PointGrid& grid,
                   const geometry::SE2& map_T_sensor, const Mixture& mixture,
                   const Spread& spread = {});

/// A maximum of the mixture and its value there.
struct MixtureMode {
  geometry::SE2 map_T_sensor;
  MixtureAt at;
  std::uint32_t lookups = 0;
};

/// Climbs from `start` by expectation and maximisation while the spread shrinks to zero
/// (deterministic annealing: at first the spread smooths away lesser maxima).
MixtureMode climb(const PreparedObservation& observation, const PointGrid& grid,
                  const geometry::SE2& start, const Mixture& mixture, Spread spread);

}  // namespace understory::constellation
