#include "sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/hash_random.hpp"

namespace understory::sim {
namespace {

using std::numbers::pi;
constexpr double kBreastHeight = 1.3;
constexpr double kRoot = 0.5;  ///< Depth of all objects below the ground, against gaps on slopes.

double direction_of(const Eigen::Vector2d& v) { return std::atan2(v.y(), v.x()); }

/// Angle from `from` to `to`, counter-clockwise, in [0, 2 pi).
double turn_from_to(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double angle = direction_of(to) - direction_of(from);
  return angle < 0.0 ? angle + 2.0 * pi : angle;
}

}  // namespace

Stem Walker::at(double time_s) const {
  const double half_m = reach_m.norm();
  // A sine of this rate covers four times the half path per period at the mean speed.
  const double rate = half_m > 0.0 ? 0.5 * pi * speed_mps / half_m : 0.0;
  Stem stem;
  stem.base_m = middle_m;
  stem.base_m.head<2>() += std::sin(rate * time_s + phase_rad) * reach_m;
  stem.base_radius_m = radius_m;
  stem.length_m = height_m;
  return stem;
}

ObjectId World::add_object(ObjectClass kind, Shape shape, std::size_t index, const Bounds& bounds) {
  objects_.push_back({bounds, kind, shape, static_cast<std::uint32_t>(index), objects_.size()});
  return static_cast<ObjectId>(objects_.size() - 1);
}

ObjectId World::add(ObjectClass kind, const Stem& stem) {
  stems_.push_back(stem);
  return add_object(kind, Shape::kStem, stems_.size() - 1, bounds_of(stem));
}
ObjectId World::add(ObjectClass kind, const Foliage& foliage) {
  foliages_.push_back(foliage);
  return add_object(kind, Shape::kFoliage, foliages_.size() - 1, bounds_of(foliage));
}
ObjectId World::add(ObjectClass kind, const Wall& wall) {
  walls_.push_back(wall);
  return add_object(kind, Shape::kWall, walls_.size() - 1, bounds_of(wall));
}
ObjectId World::add(ObjectClass kind, const Box& box) {
  boxes_.push_back(box);
  return add_object(kind, Shape::kBox, boxes_.size() - 1, bounds_of(box));
}

ObjectId World::add(const Walker& walker) {
  walkers_.push_back(walker);
  Bounds bounds = bounds_of(walker.at(0.0));
  bounds.centre_m = walker.middle_m.head<2>();
  bounds.radius_m = walker.reach_m.norm() + walker.radius_m;
  return add_object(ObjectClass::kPerson, Shape::kWalker, walkers_.size() - 1, bounds);
}

ObjectId World::add_trunk(ObjectClass kind, const Eigen::Vector2d& breast_m, double radius_m,
                          double height_m, double taper, const Eigen::Vector2d& lean) {
  TrueTrunk trunk;
  trunk.centre_m << breast_m, ground_.height(breast_m) + kBreastHeight;
  trunk.radius_m = radius_m;
  Stem stem;
  stem.axis = Eigen::Vector3d(lean.x(), lean.y(), 1.0).normalized();
  const double below = (kBreastHeight + kRoot) / stem.axis.z();
  stem.base_m = trunk.centre_m - below * stem.axis;
  stem.base_radius_m = radius_m + taper * below;
  stem.taper = taper;
  stem.length_m = height_m + kRoot;
  trunk.object = add(kind, stem);
  trunks_.push_back(trunk);

  return trunk.object;
}

void World::add_house(std::span<const Eigen::Vector2d> footprint_m, double height_m) {
  double low_m = ground_.height(footprint_m.front());
  double high_m = low_m;
  for (const Eigen::Vector2d& corner : footprint_m) {
    low_m = std::min(low_m, ground_.height(corner));
    high_m = std::max(high_m, ground_.height(corner));
  }

  const std::size_t count = footprint_m.size();
  const auto first = static_cast<ObjectId>(objects_.size());
  for (std::size_t i = 0; i < count; ++i) {
    add(ObjectClass::kWall,
        Wall{footprint_m[i], footprint_m[(i + 1) % count], low_m - kRoot, high_m + height_m});
  }

  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d before = footprint_m[(i + count - 1) % count] - footprint_m[i];
    const Eigen::Vector2d after = footprint_m[(i + 1) % count] - footprint_m[i];
    TrueCorner corner;
    corner.position_m = footprint_m[i];
    corner.ground_m = ground_.height(footprint_m[i]);

    // Counter-clockwise, the air is on the right of each wall: from `before` round to `after`.
    corner.angle_rad = turn_from_to(before, after);
    const double bisector = direction_of(before) + 0.5 * corner.angle_rad;
    corner.bisector_rad = std::remainder(bisector, 2.0 * pi);
    corner.wall_before = static_cast<ObjectId>(first + (i + count - 1) % count);
    corner.wall_after = static_cast<ObjectId>(first + i);
    corners_.push_back(corner);
  }
}

ObjectClass World::kind(ObjectId object) const {
  return object == kGroundObject ? ObjectClass::kGround : objects_[object].kind;
}

const Stem* World::stem(ObjectId object) const {
  const Object& entry = objects_[object];
  return entry.shape == Shape::kStem ? &stems_[entry.index] : nullptr;
}

std::optional<SurfaceHit> World::meet_object(const Ray& ray, ObjectId object, double time_s,
                                             std::uint64_t luck) const {
  const Object& entry = objects_[object];
  switch (entry.shape) {
    case Shape::kStem:
      return meet(ray, stems_[entry.index]);
    case Shape::kFoliage:
      return meet(ray, foliages_[entry.index], exponential_of(mixed(luck, entry.key)));
    case Shape::kWall:
      return meet(ray, walls_[entry.index]);
    case Shape::kBox:
      return meet(ray, boxes_[entry.index]);
    case Shape::kWalker:
      return meet(ray, walkers_[entry.index].at(time_s));
  }

  return std::nullopt;
}

std::optional<SurfaceHit> World::meet_ground(const Ray& ray, double max_m,
                                             std::uint64_t luck) const {
  const auto hit = ground_.cast(ray.origin_m, ray.direction, max_m);
  if (!hit) return std::nullopt;
  SurfaceHit met{hit->range_m, hit->cosine};
  if (ground_.cover_m() > 0.0 && hit->closing_m_m > 0.0) {
    // A grazing ray is stopped long before; by at most a metre: grass is not a wall.
    const double height_m = ground_.cover_m() * exponential_of(mixed(luck, kGroundObject));
    met.range_m = std::max(0.0, met.range_m - std::min(1.0, height_m / hit->closing_m_m));
  }
  return met;
}

}  // namespace understory::sim
