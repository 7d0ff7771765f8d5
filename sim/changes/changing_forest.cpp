#include "sim/changes/changing_forest.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "sim/hash_random.hpp"

namespace understory::sim::changes {
namespace {

/// Notes where each tree stands, drive by drive.
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

}  // namespace

ChangingForest make_changing_forest(const ChangingForestParameters& parameters,
                                    std::uint64_t seed) {
  Course course = make_course(SceneKind::kForest, parameters.course, seed);
  DiffParameters change;
  change.share = parameters.share;
  change.added_share = parameters.added_share;
  change.occluders = parameters.vehicles;
  change.only = ThingKind::kTree;

  ChangingForest forest;
  TreeLedger ledger;
  for (int drive = 0; drive < parameters.drives; ++drive) {
    if (drive > 0) {
      const Diff diff = make_diff(course, change, mixed(seed, static_cast<std::uint64_t>(drive)));
      course.scene = changed(course.scene, diff);
    }
    BuiltScene built = build(course.scene);
    ledger.note(built, drive);
    forest.drives.push_back({Scenario{built.world, course.route},
                             start_of(drive, parameters.days_between),
                             std::move(built.thing_of_object)});
  }
  forest.trees = ledger.take();
  return forest;
}

}  // namespace understory::sim::changes
