#include "sim/changes/changing_forest.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "sim/hash_random.hpp"

namespace understory::sim::changes {
namespace {

/// Records in which drives each tree stands.
class TreeLedger {
 public:
  void note(const BuiltScene& built, int drive) {
    for (const TrueTrunk& trunk : built.world->trunks()) {
      const ThingId id = built.thing_of(trunk.object);
      const TreeTruth fresh{id, trunk.centre_m.head<2>(), trunk.radius_m, drive, drive};
      trees_.try_emplace(id, fresh).first->second.last_drive = drive;
    }
  }
  std::vector<TreeTruth> take() const {
    std::vector<TreeTruth> trees;
    for (const auto& [id, tree] : trees_) trees.push_back(tree);
    return trees;
  }

 private:
  std::map<ThingId, TreeTruth> trees_;
};

model::Utime start_of(int drive, double days_between) {
  constexpr double kDay = 86'400e6;
  return static_cast<model::Utime>(std::llround(drive * days_between * kDay));
}

/// Pieces of 2 m along the outer side of a curved path, in free space; starting at one of its
/// thirds, by seed.
std::vector<Box> stack_of(const Course& course, double length_m, std::uint64_t seed) {
  constexpr double kPiece_m = 2.0, kThick_m = 0.4, kHigh_m = 3.0;
  constexpr double kAside_m = 1.75;
  constexpr double kSunk_m = 0.2;
  std::vector<Box> pieces;
  const double from_m = static_cast<double>(seed % 3) / 3.0 * course.route.length_m();
  for (double along_m = from_m; along_m < from_m + length_m; along_m += kPiece_m) {
    const Route::Place place = course.route.at(std::fmod(along_m, course.route.length_m()));
    const double side = place.curvature > 0.0 ? -1.0 : 1.0;
    const Eigen::Vector2d left(-std::sin(place.heading_rad), std::cos(place.heading_rad));
    const Eigen::Vector2d at_m = place.position_m + side * kAside_m * left;
    const double low_m = course.scene.ground->height(at_m) - kSunk_m;
    pieces.push_back({{at_m.x(), at_m.y(), low_m + 0.5 * kHigh_m},
                      0.5 * Eigen::Vector3d(1.15 * kPiece_m, kThick_m, kHigh_m),
                      place.heading_rad});
  }
  return pieces;
}

void add_stack(const std::vector<Box>& pieces, Scene& scene) {
  for (const Box& piece : pieces) {
    Thing thing;
    thing.kind = ThingKind::kEquipment;
    thing.parts = {piece};
    thing.extent = piece;
    scene.add(std::move(thing));
  }
}

}  // namespace

ChangingForest make_changing_forest(const ChangingForestParameters& parameters,
                                    std::uint64_t seed) {
  Course course = make_course(SceneKind::kForest, parameters.course, seed);
  DiffParameters change;
  change.share = parameters.share;
  change.added_share = parameters.added_share;
  change.occluders = parameters.vehicles;
  change.only = ThingKind::kTree;

  const std::vector<Box> stack = stack_of(course, parameters.stack_m, seed);
  ChangingForest forest;
  TreeLedger ledger;
  for (int drive = 0; drive < parameters.drives; ++drive) {
    if (drive > 0) {
      const Diff diff = make_diff(course, change, mixed(seed, static_cast<std::uint64_t>(drive)));
      course.scene = changed(course.scene, diff);
      if (drive == 1) add_stack(stack, course.scene);
    }
    BuiltScene built = build(course.scene);
    ledger.note(built, drive);
    forest.drives.push_back(
        {Scenario{built.world, course.route}, start_of(drive, parameters.days_between),
         std::move(built.thing_of_object), drive > 0 ? stack : std::vector<Box>()});
  }
  forest.trees = ledger.take();
  return forest;
}

}  // namespace understory::sim::changes
