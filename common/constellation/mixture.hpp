// How well a pose explains all points of an observation, with no point tied to one landmark.
#pragma once

#include <cstdint>

#include "common/constellation/grid.hpp"
#include "common/constellation/observation.hpp"
#include "common/geometry/se2.hpp"

namespace understory::constellation {

/// The model: a point is of no landmark with probability 1 - `share`, and lies then anywhere; else
/// it is of any of the landmarks around, `density` of them on a square metre.
struct Mixture {
  double share = 0.9;
  double density_per_m2 = 0.01;
};

/// What a pose is known to while it is sought: widens each point's noise. About `centre`, frame
/// `sensor`.
struct Spread {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double translation_variance = 0.0;  ///< [m^2] Per axis.
  double rotation_variance = 0.0;     ///< [rad^2]
};

/// The mixture at one pose. Tangent order, right perturbation.
struct MixtureAt {
  double log_likelihood = 0.0;  ///< Against all points lying anywhere; natural logarithm.
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  /// If it were known which landmark each point is of.
  Eigen::Matrix3d complete = Eigen::Matrix3d::Zero();
  /// What not knowing it takes away (Louis 1982).
  Eigen::Matrix3d missing = Eigen::Matrix3d::Zero();
  std::uint32_t lookups = 0;  ///< Points looked up in the map.

  /// Information on the pose: of the observation as it is.
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

/// Climbs from `start` by expectation and maximisation while the spread shrinks to nothing
/// (deterministic annealing: what is between start and maximum is smoothed away at first).
MixtureMode climb(const PreparedObservation& observation, const PointGrid& grid,
                  const geometry::SE2& start, const Mixture& mixture, Spread spread);

}  // namespace understory::constellation
