// A world as a list of things with permanent ids, so that changed copies can be made of it.
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

/// Id of a thing: the same in every copy of a scene, never reused for another thing.
using ThingId = std::uint32_t;
/// The ground, which never changes.
inline constexpr ThingId kGroundThing = 0;

/// Kind of a thing.
enum class ThingKind : std::uint8_t {
  kGround,
  kStructure,  ///< Walls, floor, ceiling: never changed.
  kTree,
  kBush,
  kVehicle,    ///< A parked car.
  kLorry,      ///< Hides things behind it; in rooms a loaded cart of a man's height.
  kFurniture,  ///< Desks and racks.
  kEquipment,  ///< Boxes, bags, tanks; in a forest piles of logs.
};
/// The name in files, e.g. "tree".
std::string_view to_string(ThingKind kind);

/// A tree for plant_tree(); its shape follows from its thing's id.
struct Tree {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< 1.3 m above the ground, frame `world`.
  double radius_m = 0.15;                          ///< At that height.
  double crown_base_m = 4.0;                       ///< Above the ground.
};
/// A bush for plant_bush().
struct Bush {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< Frame `world`.
};
/// A part of a thing. A Stem here is an upright tank or pole.
using Part = std::variant<Tree, Bush, Wall, Box, Stem>;

/// An object that is present as a whole or absent.
struct Thing {
  ThingId id = kGroundThing;
  ThingKind kind = ThingKind::kEquipment;
  std::vector<Part> parts;  ///< Frame `world`.
  Box extent;               ///< Bounding box without branches and leaves.

  /// Whether it may be removed or moved.
  bool is_changeable() const { return kind != ThingKind::kStructure; }
  /// Whether it may be moved: plants cannot.
  bool is_movable() const {
    return is_changeable() && kind != ThingKind::kTree && kind != ThingKind::kBush;
  }
};
/// The thing displaced by `by_m` [m].
Thing moved(Thing thing, const Eigen::Vector3d& by_m);

/// The kinds of worlds.
enum class SceneKind : std::uint8_t { kForest, kOffice, kStation };
/// "forest", "office", "station".
std::string_view to_string(SceneKind kind);
/// The kind with this name; none for another.
std::optional<SceneKind> scene_kind(std::string_view name);
/// All names accepted by scene_kind().
std::vector<std::string> scene_names();

/// All things and the ground below them.
struct Scene {
  SceneKind kind = SceneKind::kOffice;
  std::uint64_t seed = 0;  ///< Shapes of trees and textures follow from it and from the ids.
  std::shared_ptr<const Ground> ground;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();   ///< Of the filled part.
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();  ///< Opposite corner.
  std::vector<Thing> things;                         ///< In order of id.
  ThingId next_id = kGroundThing + 1;                ///< Free, with all larger ids.

  /// The thing with this id; null if there is none. O(log n).
  const Thing* find(ThingId id) const;
  /// Adds a thing with the next id, and returns the id.
  ThingId add(Thing thing);
};

/// A scene built for ray casting.
struct BuiltScene {
  std::shared_ptr<const World> world;
  std::vector<ThingId> thing_of_object;  ///< By ObjectId.

  /// The thing of an object; kGroundThing for the ground.
  ThingId thing_of(ObjectId object) const {
    return object == kGroundObject ? kGroundThing : thing_of_object[object];
  }
};
/// Builds the world. A thing has the same shape, and its leaves stop the same rays, in every copy
/// of the scene.
BuiltScene build(const Scene& scene);

/// Generator of the random numbers of one thing for one purpose.
std::mt19937_64 random_of_thing(const Scene& scene, ThingId id, std::uint64_t purpose);

}  // namespace understory::sim::changes
