#include "sim/visible_landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace understory::sim {
namespace {

Eigen::Vector3d in_level(const VehicleState& state, const Eigen::Vector3d& world_m) {
  const Eigen::Vector3d away = world_m - state.position_m;
  const double c = std::cos(state.yaw_rad);
  const double s = std::sin(state.yaw_rad);
  return {c * away.x() + s * away.y(), c * away.y() - s * away.x(), away.z()};
}

std::vector<VisibleTrunk> trunks_among(const World& world, std::vector<ObjectId> objects,
                                       const VehicleState& state, std::uint32_t least_returns) {
  std::sort(objects.begin(), objects.end());
  std::vector<VisibleTrunk> result;
  auto hit = objects.begin();

  // Trunks were added in order of object.
  for (const TrueTrunk& trunk : world.trunks()) {
    hit = std::lower_bound(hit, objects.end(), trunk.object);
    if (hit == objects.end()) break;
    const auto end = std::upper_bound(hit, objects.end(), trunk.object);
    const auto returns = static_cast<std::uint32_t>(end - hit);
    hit = end;
    if (returns == 0 || returns < least_returns) continue;
    const Eigen::Vector3d centre = in_level(state, trunk.centre_m);
    result.push_back({trunk.object, world.kind(trunk.object), centre, trunk.radius_m,
                      centre.head<2>().norm(), returns});
  }

  return result;
}

}  // namespace

std::vector<VisibleTrunk> visible_trunks(const World& world, const SimulatedSweep& sweep,
                                         const VehicleState& state, std::uint32_t least_returns) {
  return trunks_among(world, sweep.objects, state, least_returns);
}

std::vector<VisibleTrunk> visible_trunks(const World& world, const SimulatedPlanarScan& scan,
                                         const VehicleState& state, std::uint32_t least_returns) {
  std::vector<ObjectId> objects;
  for (std::size_t i = 0; i < scan.objects.size(); ++i) {
    if (scan.is_return[i] != 0) objects.push_back(scan.objects[i]);
  }
  return trunks_among(world, std::move(objects), state, least_returns);
}

std::vector<VisibleCorner> visible_corners(const World& world, const SimulatedSweep& sweep,
                                           const VehicleState& state, double side_m) {
  // Points on each wall that was hit.
  std::map<ObjectId, std::vector<Eigen::Vector2d>> walls;
  for (std::size_t i = 0; i < sweep.objects.size(); ++i) {
    if (world.kind(sweep.objects[i]) != ObjectClass::kWall) continue;
    walls[sweep.objects[i]].emplace_back(sweep.true_m[i].head<2>().cast<double>());
  }

  const auto returns_near = [&](ObjectId wall, const Eigen::Vector2d& edge) {
    const auto points = walls.find(wall);
    if (points == walls.end()) return std::uint32_t{0};
    return static_cast<std::uint32_t>(
        std::count_if(points->second.begin(), points->second.end(),
                      [&](const Eigen::Vector2d& p) { return (p - edge).norm() <= side_m; }));
  };

  std::vector<VisibleCorner> result;
  const auto corners = world.corners();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const TrueCorner& corner = corners[i];
    VisibleCorner visible;
    visible.returns_before = returns_near(corner.wall_before, corner.position_m);
    visible.returns_after = returns_near(corner.wall_after, corner.position_m);
    if (visible.returns_before + visible.returns_after == 0) continue;

    visible.corner = static_cast<std::uint32_t>(i);
    visible.position_m =
        in_level(state, {corner.position_m.x(), corner.position_m.y(), corner.ground_m});
    visible.bisector_rad =
        std::remainder(corner.bisector_rad - state.yaw_rad, 2.0 * std::numbers::pi);
    visible.angle_rad = corner.angle_rad;
    visible.range_m = visible.position_m.head<2>().norm();
    result.push_back(visible);
  }

  return result;
}

}  // namespace understory::sim
