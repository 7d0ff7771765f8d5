// From a few pairs of observed point and landmark to the best pose on all of them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/constellation/observation.hpp"
#include "common/geometry/se2.hpp"

namespace understory::constellation {

/// An observed point and the landmark that a pose gives it.
struct Pair {
  std::uint32_t point = 0;  ///< Prepared point.
  Slot slot = kNoSlot;
  double squared_m2 = 0.0;  ///< Distance left between them.
};

/// A pose with the pairs that it rests on.
struct FittedPose {
  geometry::SE2 map_T_sensor;
  std::vector<Pair> pairs;  ///< One to one, by point.
  double mean_chance =
      1.0;  ///< Landmarks in the gate of a point of none, averaged over the points.
  /// log10 of the bound on the probability of so many hits by chance, for one hypothesis.
  double log10_tail = 0.0;
  std::uint32_t lookups = 0;  ///< Points looked up in the map, the work done.
};

/// The landmark closest to (x, y) within the gate; kNoSlot if none. The squared distance is
/// returned in `squared_m2`.
Slot nearest_slot(const PointGrid& grid, double x, double y, double gate_m, double& squared_m2);

/// Refits the motion in closed form and gathers the pairs anew, each point's gate following from
/// its own noise and the pose's, until the pairs stay the same. Where there are many points, those
/// around the pairs are asked first; without pairs if they do not agree. Precondition: at least two
/// pairs.
FittedPose fit_pose(const PreparedObservation& observation, const PointGrid& grid,
                    const std::vector<Pair>& pairs, const LocaliseParameters& parameters);

/// The pairs of a pose as it is, and what chance has to do with them. `pairs` say how well about
/// the pose is known. Precondition: at least two pairs.
FittedPose pairs_at(const PreparedObservation& observation, const PointGrid& grid,
                    const geometry::SE2& map_T_sensor, const std::vector<Pair>& pairs,
                    const LocaliseParameters& parameters);

/// True if both rest on largely the same pairs.
bool same_pose(const FittedPose& a, const FittedPose& b);

}  // namespace understory::constellation
