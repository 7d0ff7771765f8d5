#include "sim/changes/scene.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "sim/forest_world.hpp"
#include "sim/hash_random.hpp"

namespace understory::sim::changes {
namespace {

constexpr std::uint64_t kShapePurpose = 0x5ba9e;

constexpr std::array<std::string_view, 8> kThingNames{
    "ground", "structure", "tree", "bush", "vehicle", "lorry", "furniture", "equipment"};
constexpr std::array<std::string_view, 3> kSceneNames{"forest", "office", "station"};

template <typename Kind, std::size_t N>
std::optional<Kind> kind_of_name(const std::array<std::string_view, N>& names,
                                 std::string_view name) {
  const auto* const found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Kind>(found - names.begin());
}

ObjectClass class_of(ThingKind kind) {
  switch (kind) {
    case ThingKind::kStructure:
      return ObjectClass::kWall;
    case ThingKind::kVehicle:
    case ThingKind::kLorry:
      return ObjectClass::kCar;
    default:
      return ObjectClass::kFurniture;
  }
}

/// Adds the parts of one thing to a world.
class PartBuilder {
 public:
  PartBuilder(World& world, const Thing& thing, std::mt19937_64 random)
      : world_(world), thing_(thing), random_(random) {}

  void operator()(const Tree& tree) {
    plant_tree(world_, tree.at_m, tree.radius_m, tree.crown_base_m, ForestWorldParameters{},
               random_);
  }
  void operator()(const Bush& bush) {
    plant_bush(world_, bush.at_m, ForestWorldParameters{}.bush_density_per_m, random_);
  }
  void operator()(const Wall& wall) { world_.add(class_of(thing_.kind), wall); }
  void operator()(const Box& box) { world_.add(class_of(thing_.kind), box); }
  void operator()(const Stem& stem) { world_.add(class_of(thing_.kind), stem); }

 private:
  World& world_;
  const Thing& thing_;
  std::mt19937_64 random_;
};

/// Displaces one part.
struct PartMover {
  Eigen::Vector3d by_m;

  void operator()(Tree& tree) const { tree.at_m += by_m.head<2>(); }
  void operator()(Bush& bush) const { bush.at_m += by_m.head<2>(); }
  void operator()(Wall& wall) const {
    wall.from_m += by_m.head<2>();
    wall.to_m += by_m.head<2>();
    wall.low_m += by_m.z();
    wall.high_m += by_m.z();
  }
  void operator()(Box& box) const { box.centre_m += by_m; }
  void operator()(Stem& stem) const { stem.base_m += by_m; }
};

}  // namespace

std::string_view to_string(ThingKind kind) { return kThingNames[static_cast<std::size_t>(kind)]; }
std::string_view to_string(SceneKind kind) { return kSceneNames[static_cast<std::size_t>(kind)]; }
std::optional<SceneKind> scene_kind(std::string_view name) {
  return kind_of_name<SceneKind>(kSceneNames, name);
}

std::vector<std::string> scene_names() { return {kSceneNames.begin(), kSceneNames.end()}; }

Thing moved(Thing thing, const Eigen::Vector3d& by_m) {
  for (Part& part : thing.parts) std::visit(PartMover{by_m}, part);
  thing.extent.centre_m += by_m;
  return thing;
}

const Thing* Scene::find(ThingId id) const {
  const auto found = std::lower_bound(things.begin(), things.end(), id,
                                      [](const Thing& thing, ThingId x) { return thing.id < x; });
  return found != things.end() && found->id == id ? &*found : nullptr;
}

ThingId Scene::add(Thing thing) {
  thing.id = next_id++;
  things.push_back(std::move(thing));
  return things.back().id;
}

std::mt19937_64 random_of_thing(const Scene& scene, ThingId id, std::uint64_t purpose) {
  return std::mt19937_64(mixed(mixed(scene.seed, purpose), id));
}

BuiltScene build(const Scene& scene) {
  World world(*scene.ground);
  BuiltScene built;
  for (const Thing& thing : scene.things) {
    PartBuilder builder(world, thing, random_of_thing(scene, thing.id, kShapePurpose));
    for (const Part& part : thing.parts) std::visit(builder, part);
    const std::size_t first = built.thing_of_object.size();
    built.thing_of_object.resize(world.object_count(), thing.id);
    for (std::size_t i = first; i < world.object_count(); ++i) {
      const std::uint64_t key = (std::uint64_t{thing.id} << 32) + (i - first);
      world.set_key(static_cast<ObjectId>(i), key);
    }
  }
  built.world = std::make_shared<const World>(std::move(world));
  return built;
}

}  // namespace understory::sim::changes
