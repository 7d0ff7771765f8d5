#include "sim/changes/placing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/forest_world.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim::changes {
namespace {

using std::numbers::pi;

constexpr double kTrunkExtentHeight = 6.0;  ///< Of the occupied part [m].

Eigen::Vector2d heading_vector(double rad) { return {std::cos(rad), std::sin(rad)}; }

/// Half of the box's width along a direction of the plan.
double half_width(const Box& box, const Eigen::Vector2d& axis) {
  const Eigen::Vector2d ahead = heading_vector(box.heading_rad);
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  return box.half_size_m.x() * std::abs(axis.dot(ahead)) +
         box.half_size_m.y() * std::abs(axis.dot(left));
}

double ground_at(const Scene& scene, const Eigen::Vector2d& at_m) {
  return scene.ground->height(at_m);
}

Eigen::Vector2d anywhere(const Scene& scene, std::mt19937_64& random) {
  const double x = uniform(random, scene.low_m.x(), scene.high_m.x());
  return {x, uniform(random, scene.low_m.y(), scene.high_m.y())};
}

/// A box with its lower side at `bottom_m`.
Box box_on(const Eigen::Vector2d& at_m, double bottom_m, const Eigen::Vector3d& size_m,
           double heading_rad) {
  return {{at_m.x(), at_m.y(), bottom_m + 0.5 * size_m.z()}, 0.5 * size_m, heading_rad};
}

Thing thing_of_boxes(ThingKind kind, std::vector<Part> parts, const Box& extent) {
  Thing thing;
  thing.kind = kind;
  thing.parts = std::move(parts);
  thing.extent = extent;
  return thing;
}

Thing single_box(ThingKind kind, const Box& box) { return thing_of_boxes(kind, {box}, box); }

Thing tank(const Eigen::Vector2d& at_m, double bottom_m, double radius_m, double height_m) {
  Stem stem;
  stem.base_m << at_m, bottom_m;
  stem.base_radius_m = radius_m;
  stem.length_m = height_m;
  const Box extent = box_on(at_m, bottom_m, {2.0 * radius_m, 2.0 * radius_m, height_m}, 0.0);
  return thing_of_boxes(ThingKind::kEquipment, {stem}, extent);
}

Thing tree(const Scene& scene, const Eigen::Vector2d& at_m, std::mt19937_64& random) {
  const ForestWorldParameters plants;
  const double radius_m = draw_radius_m(plants, random);
  const double crown_base_m = plants.crown_base_m * uniform(random, 0.7, 1.3);
  const Box extent = box_on(at_m, ground_at(scene, at_m),
                            {2.0 * radius_m, 2.0 * radius_m, kTrunkExtentHeight}, 0.0);
  return thing_of_boxes(ThingKind::kTree, {Tree{at_m, radius_m, crown_base_m}}, extent);
}

Thing bush(const Scene& scene, const Eigen::Vector2d& at_m) {
  return thing_of_boxes(ThingKind::kBush, {Bush{at_m}},
                        box_on(at_m, ground_at(scene, at_m), {1.6, 1.6, 1.2}, 0.0));
}

/// A position beside the path, `aside_m` from it, and the path's heading there.
struct Roadside {
  Eigen::Vector2d at_m;
  double heading_rad;
};
Roadside beside(std::span<const Eigen::Vector3d> path_m, double aside_m, std::mt19937_64& random) {
  std::uniform_int_distribution<std::size_t> draw(1, std::max<std::size_t>(1, path_m.size() - 1));
  std::size_t i = draw(random);
  // While hovering the path has no heading.
  while (i > 1 && (path_m[i] - path_m[i - 1]).head<2>().norm() < 1e-4) --i;
  const Eigen::Vector2d step = (path_m[i] - path_m[i - 1]).head<2>();
  const double heading = std::atan2(step.y(), step.x());
  const double side = uniform(random, 0.0, 1.0) < 0.5 ? 1.0 : -1.0;
  const Eigen::Vector2d left(-std::sin(heading), std::cos(heading));
  return {path_m[i].head<2>() + side * aside_m * left, heading};
}

/// Body and cabin; wheels are not drawn.
Thing vehicle(const Scene& scene, const Roadside& where, std::mt19937_64& random) {
  const double ground = ground_at(scene, where.at_m);
  const double length = uniform(random, 3.8, 4.6);
  const double heading = where.heading_rad + uniform(random, -0.1, 0.1);
  const Box body = box_on(where.at_m, ground + 0.2, {length, 1.75, 0.65}, heading);
  const Eigen::Vector2d cabin_at = where.at_m - 0.08 * length * heading_vector(heading);
  const Box cabin = box_on(cabin_at, ground + 0.85, {0.55 * length, 1.5, 0.6}, heading);
  return thing_of_boxes(ThingKind::kVehicle, {body, cabin},
                        box_on(where.at_m, ground, {length, 1.75, 1.5}, heading));
}

Thing lorry(const Scene& scene, const Roadside& where, std::mt19937_64& random) {
  const double heading = where.heading_rad + uniform(random, -0.05, 0.05);
  return single_box(ThingKind::kLorry, box_on(where.at_m, ground_at(scene, where.at_m) + 0.3,
                                              {8.0, 2.5, 3.2}, heading));
}

Thing in_forest(const Scene& scene, ThingKind kind, std::span<const Eigen::Vector3d> path_m,
                std::mt19937_64& random) {
  switch (kind) {
    case ThingKind::kVehicle:
      return vehicle(scene, beside(path_m, uniform(random, 3.5, 6.0), random), random);
    case ThingKind::kLorry:
      return lorry(scene, beside(path_m, uniform(random, 4.0, 7.0), random), random);
    case ThingKind::kEquipment: {
      const Eigen::Vector2d at = beside(path_m, uniform(random, 4.0, 15.0), random).at_m;
      const Eigen::Vector3d logs(uniform(random, 2.0, 4.0), 1.2, uniform(random, 0.6, 1.4));
      return single_box(kind, box_on(at, ground_at(scene, at), logs, uniform(random, -pi, pi)));
    }
    case ThingKind::kBush:
      return bush(scene, anywhere(scene, random));
    default:
      return tree(scene, anywhere(scene, random), random);
  }
}

Thing in_office(const Scene& scene, ThingKind kind, std::span<const Eigen::Vector3d> path_m,
                std::mt19937_64& random) {
  const Eigen::Vector2d at = anywhere(scene, random);
  const double heading = uniform(random, 0.0, 1.0) < 0.5 ? 0.0 : 0.5 * pi;
  if (kind == ThingKind::kLorry) {
    const Roadside where = beside(path_m, uniform(random, 0.85, 1.3), random);
    return single_box(kind, box_on(where.at_m, 0.05, {1.3, 0.5, 1.8}, where.heading_rad));
  }
  if (kind == ThingKind::kFurniture) {
    const std::array<Eigen::Vector3d, 3> sizes{
        Eigen::Vector3d(1.6, 0.8, 0.75), {0.9, 0.45, 1.9}, {0.8, 0.5, 1.2}};
    const auto which = std::uniform_int_distribution<std::size_t>(0, sizes.size() - 1)(random);
    return single_box(kind, box_on(at, 0.0, sizes[which], heading));
  }

  if (uniform(random, 0.0, 1.0) < 0.4)
    return tank(at, 0.0, uniform(random, 0.15, 0.3), uniform(random, 0.5, 1.4));
  const double side = uniform(random, 0.3, 0.6);
  return single_box(kind, box_on(at, 0.0, {side, side, uniform(random, 0.3, 0.9)}, heading));
}

/// Things of a station are at its two long walls, at any height.
Thing in_station(const Scene& scene, ThingKind kind, std::span<const Eigen::Vector3d> path_m,
                 std::mt19937_64& random) {
  const double height = scene.high_m.z() - scene.low_m.z();
  if (kind == ThingKind::kLorry) {
    const Roadside where = beside(path_m, uniform(random, 0.7, 1.0), random);
    return single_box(kind, box_on(where.at_m, 0.3, {1.2, 0.3, 1.7}, where.heading_rad));
  }

  const double x = uniform(random, scene.low_m.x(), scene.high_m.x());
  const bool is_left = uniform(random, 0.0, 1.0) < 0.5;
  const auto at_wall = [&](double depth) {
    const double y = is_left ? scene.high_m.y() - 0.5 * depth : scene.low_m.y() + 0.5 * depth;
    return Eigen::Vector2d(x, y);
  };
  if (kind == ThingKind::kFurniture)
    return single_box(kind, box_on(at_wall(0.5), 0.05, {0.95, 0.5, height - 0.1}, 0.0));

  const double low = uniform(random, 0.05, height - 0.75);
  if (uniform(random, 0.0, 1.0) < 0.3)
    return tank(at_wall(0.4), low, uniform(random, 0.1, 0.2), uniform(random, 0.3, 0.65));
  const double depth = uniform(random, 0.2, 0.5);
  const Eigen::Vector3d bag(uniform(random, 0.3, 0.7), depth, uniform(random, 0.25, 0.6));
  return single_box(kind, box_on(at_wall(depth), low, bag, 0.0));
}

}  // namespace

bool are_close(const Box& a, const Box& b, double gap_m) {
  const double rise = std::abs(a.centre_m.z() - b.centre_m.z());
  if (rise >= a.half_size_m.z() + b.half_size_m.z()) return false;

  // Two convex shapes are disjoint if they are so along a normal of one of their sides.
  const Eigen::Vector2d between = (b.centre_m - a.centre_m).head<2>();
  for (const double heading : {a.heading_rad, b.heading_rad}) {
    const Eigen::Vector2d ahead = heading_vector(heading);
    for (const Eigen::Vector2d& axis : {ahead, Eigen::Vector2d(-ahead.y(), ahead.x())}) {
      const double reach = half_width(a, axis) + half_width(b, axis) + gap_m;
      if (std::abs(axis.dot(between)) >= reach) return false;
    }
  }
  return true;
}

bool is_within(const Scene& scene, const Box& box) {
  Eigen::Array2d half(half_width(box, Eigen::Vector2d::UnitX()),
                      half_width(box, Eigen::Vector2d::UnitY()));
  if (scene.kind == SceneKind::kForest) half.setZero();
  const Eigen::Array2d at = box.centre_m.head<2>().array();
  return (at - half >= scene.low_m.head<2>().array() - 1e-9).all() &&
         (at + half <= scene.high_m.head<2>().array() + 1e-9).all();
}

double distance_m(const Box& box, const Eigen::Vector3d& point_m) {
  const Eigen::Vector2d ahead = heading_vector(box.heading_rad);
  const Eigen::Vector3d d = point_m - box.centre_m;
  const Eigen::Vector3d local(ahead.dot(d.head<2>()), ahead.x() * d.y() - ahead.y() * d.x(), d.z());
  return (local.cwiseAbs() - box.half_size_m).cwiseMax(0.0).norm();
}

bool FreeSpace::has_room(const Box& box) const {
  const bool is_in_way = std::any_of(
      path_m_.begin(), path_m_.end(),
      [&](const Eigen::Vector3d& place) { return distance_m(box, place) < clearance_m_; });
  return !is_in_way && std::none_of(taken_.begin(), taken_.end(), [&](const Box& other) {
    return are_close(box, other, gap_m_);
  });
}

FreeSpace free_space(const Scene& scene, std::span<const Eigen::Vector3d> path_m) {
  const bool is_forest = scene.kind == SceneKind::kForest;
  FreeSpace space(path_m, is_forest ? 2.0 : 0.4, is_forest ? 0.3 : 0.02);
  for (const Thing& thing : scene.things) {
    if (thing.is_changeable()) space.take(thing.extent);
  }
  return space;
}

Thing propose(const Scene& scene, ThingKind kind, std::span<const Eigen::Vector3d> path_m,
              std::mt19937_64& random) {
  switch (scene.kind) {
    case SceneKind::kForest:
      return in_forest(scene, kind, path_m, random);
    case SceneKind::kOffice:
      return in_office(scene, kind, path_m, random);
    case SceneKind::kStation:
      return in_station(scene, kind, path_m, random);
  }
  return {};
}

std::optional<Thing> place(const Scene& scene, ThingKind kind, FreeSpace& space,
                           std::mt19937_64& random, int tries) {
  for (int i = 0; i < tries; ++i) {
    Thing thing = propose(scene, kind, space.path_m(), random);
    if (!is_within(scene, thing.extent) || !space.has_room(thing.extent)) continue;
    space.take(thing.extent);
    return thing;
  }
  return std::nullopt;
}

}  // namespace understory::sim::changes
