// Landmarks that an extractor should find in a sweep: the reference for its evaluation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "sim/planar_laser.hpp"
#include "sim/spinning_lidar.hpp"
#include "sim/vehicle_motion.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// A trunk or pole with returns. Frame `vehicle_level` of the given state.
struct VisibleTrunk {
  ObjectId object = 0;
  ObjectClass kind = ObjectClass::kTrunk;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< 1.3 m above the ground.
  double radius_m = 0.0;                               ///< At that height.
  double range_m = 0.0;                                ///< From the vehicle's origin, in the plan.
  std::uint32_t returns = 0;
};
/// A corner with returns on at least one of its walls.
struct VisibleCorner {
  std::uint32_t corner = 0;                              ///< Index in World::corners().
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< On the ground.
  double bisector_rad = 0.0;  ///< Out of the house, from straight ahead, left positive.
  double angle_rad = 0.0;     ///< Outside the house; more than pi at a convex edge.
  double range_m = 0.0;
  std::uint32_t returns_before = 0;  ///< On the wall that ends there, within `side_m` of the edge.
  std::uint32_t returns_after = 0;   ///< On the wall that begins there.
};

/// Trunks and poles with at least `least_returns` returns, in order of object.
std::vector<VisibleTrunk> visible_trunks(const World& world, const SimulatedSweep& sweep,
                                         const VehicleState& state,
                                         std::uint32_t least_returns = 1);
/// The same for a one-plane laser.
std::vector<VisibleTrunk> visible_trunks(const World& world, const SimulatedPlanarScan& scan,
                                         const VehicleState& state,
                                         std::uint32_t least_returns = 1);
/// Corners with returns within `side_m` of the edge on one side at least, in order of corner.
std::vector<VisibleCorner> visible_corners(const World& world, const SimulatedSweep& sweep,
                                           const VehicleState& state, double side_m = 2.0);

}  // namespace understory::sim
