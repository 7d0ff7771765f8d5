// A world as a list of things, each with an id for good, so that copies of it can differ.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/ground.hpp"
#include "sim/shapes.hpp"
#include "sim/world.hpp"

namespace understory::sim::changes {

/// Id of a thing: the same in every copy of a scene, never used again for another thing.
using ThingId = std::uint32_t;
/// The ground, which is no thing that could change.
inline constexpr ThingId kGroundThing = 0;

/// What a thing is.
enum class ThingKind : std::uint8_t {
  kGround,
  kStructure,  ///< Walls, floor, ceiling: never changed.
  kTree,
  kBush,
  kVehicle,    ///< A parked car.
  kLorry,      ///< Hides what stands behind it; in rooms a loaded cart of a man's height.
  kFurniture,  ///< Desks and racks.
  kEquipment,  ///< Boxes, bags, tanks; in a wood piles of logs.
};
/// The name in files, e.g. "tree".
std::string_view to_string(ThingKind kind);
/// The kind of this name; none for another.
std::optional<ThingKind> thing_kind(std::string_view name);

/// A tree as plant_tree() grows it, in the shape that its thing's id gives.
struct Tree {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< 1.3 m above the ground, frame `world`.
  double radius_m = 0.15;                          ///< There.
  double crown_base_m = 4.0;                       ///< Above the ground.
};
/// A bush as plant_bush() grows it.
struct Bush {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< Frame `world`.
};
/// What a thing is made of. A Stem here is an upright tank or pole.
using Part = std::variant<Tree, Bush, Wall, Box, Stem>;

/// Something that is there as a whole or not at all.
struct Thing {
  ThingId id = kGroundThing;
  ThingKind kind = ThingKind::kEquipment;
  std::vector<Part> parts;  ///< Frame `world`.
  Box extent;               ///< Around all of it but branches and leaves.

  /// Whether it may be removed or moved.
  bool is_changeable() const { return kind != ThingKind::kStructure; }
  /// Whether it may be moved: what grows cannot.
  bool is_movable() const {
    return is_changeable() && kind != ThingKind::kTree && kind != ThingKind::kBush;
  }
};
/// The thing displaced by `by_m` [m].
Thing moved(Thing thing, const Eigen::Vector3d& by_m);

/// The worlds that there are.
enum class SceneKind : std::uint8_t { kForest, kOffice, kStation };
/// "forest", "office", "station".
std::string_view to_string(SceneKind kind);
/// The kind of this name; none for another.
std::optional<SceneKind> scene_kind(std::string_view name);
/// All names that scene_kind() takes.
std::vector<std::string> scene_names();

/// All things and the ground below them.
struct Scene {
  SceneKind kind = SceneKind::kOffice;
  std::uint64_t seed = 0;  ///< Shapes of trees and textures follow from it and from the ids.
  std::shared_ptr<const Ground> ground;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();   ///< Of the part that is filled.
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();  ///< Opposite corner.
  std::vector<Thing> things;                         ///< In order of id.
  ThingId next_id = kGroundThing + 1;                ///< Free, as are all above it.

  /// The thing with this id; null where there is none. O(log n).
  const Thing* find(ThingId id) const;
  /// Adds a thing under the next id, which it returns.
  ThingId add(Thing thing);
};

/// A scene as rays meet it.
struct BuiltScene {
  std::shared_ptr<const World> world;
  std::vector<ThingId> thing_of_object;  ///< By ObjectId.

  /// The thing that an object belongs to; kGroundThing for the ground.
  ThingId thing_of(ObjectId object) const {
    return object == kGroundObject ? kGroundThing : thing_of_object[object];
  }
};
/// Builds the world. A thing has the same shape, and stops the same rays with its leaves, in every
/// copy of the scene.
BuiltScene build(const Scene& scene);

/// Generator of the random numbers of one thing for one purpose.
std::mt19937_64 random_of_thing(const Scene& scene, ThingId id, std::uint64_t purpose);

}  // namespace understory::sim::changes
