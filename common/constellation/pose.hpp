// The best pose on all points, from a few pairs of observed point and landmark.
#pragma once

#include <cstdint>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/constellation/observation.hpp"
#include "common/geometry/se2.hpp"

namespace understory::constellation {

/// An observed point and the landmark paired with it at a pose.
struct Pair {
  std::uint32_t point = 0;  ///< Index of the prepared point.
  Slot slot = kNoSlot;
  double squared_m2 = 0.0;  ///< Squared distance between them.
};

/// A pose and its pairs.
struct FittedPose {
  geometry::SE2 map_T_sensor;
  std::vector<Pair> pairs;   ///< One to one, by point.
  double mean_chance = 1.0;  ///< Expected landmarks by chance in a gate, averaged over the points.
  /// log10 of the bound on the probability of so many hits by chance, for one hypothesis.
  double log10_tail = 0.0;
  std::uint32_t lookups = 0;  ///< Look-ups of points in the map (the cost).
};

/// The landmark closest to (x, y) within the gate; kNoSlot if none. The squared distance is
/// returned in `squared_m2`.
Slot nearest_slot(const PointGrid& grid, double x, double y, double gate_m, double& squared_m2);

/// Refits the motion in closed form and finds the pairs again, until the pairs stay the same. Each
/// point's gate follows from its noise and the pose's covariance. Of many points, those around the
/// pairs are fitted first; if they do not agree, the result has no pairs. Precondition: at least
/// two pairs.
FittedPose fit_pose(const PreparedObservation& observation, const PointGrid& grid,
                    const std::vector<Pair>& pairs, const LocaliseParameters& parameters);

/// The pairs at a given pose without a refit, and the bound on chance. `pairs` determine the pose's
/// covariance. Precondition: at least two pairs.
FittedPose pairs_at(const PreparedObservation& observation, const PointGrid& grid,
                    const geometry::SE2& map_T_sensor, const std::vector<Pair>& pairs,
                    const LocaliseParameters& parameters);

/// True if both have largely the same pairs.
bool same_pose(const FittedPose& a, const FittedPose& b);

}  // namespace understory::constellation
