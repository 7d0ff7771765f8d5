// Drives through one forest that changes between them, for the whole chain from raw LIDAR.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim/changes/diff.hpp"
#include "sim/sensor_drive.hpp"
#include "sim/shapes.hpp"

namespace understory::sim::changes {

/// The forest, and its rate of change.
struct ChangingForestParameters {
  /// The forest extends beyond the detection range of trunks around the path.
  CourseParameters course{.length_m = 300.0, .margin_m = 60.0, .forest = ForestKind::kIntermediate};
  int drives = 6;            ///< The first one maps.
  double share = 0.1;        ///< Of the trees, felled between two drives.
  double added_share = 1.0;  ///< New trees per felled one.
  int vehicles = 0;          ///< New lorries beside the path in each drive but the first.
  /// Length of a stack of timber, as high as a lorry, close along the outer side of the path in all
  /// drives but the first; 0 = none.
  double stack_m = 0.0;
  double days_between = 30.0;
};

/// A tree of any of the drives.
struct TreeTruth {
  ThingId id = kGroundThing;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< At that height.
  double radius_m = 0.0;                                 ///< There.
  int first_drive = 0;                                   ///< First drive in which it stands.
  int last_drive = 0;                                    ///< Last drive in which it stands.
  bool stands_in(int drive) const { return drive >= first_drive && drive <= last_drive; }
};

/// One drive. World and path are those of a SensorDrive, so all functions for drives can use it.
struct ForestDrive {
  Scenario scenario;
  model::Utime utime_of_start = 0;
  std::vector<ThingId> thing_of_object;  ///< By ObjectId of the scenario's world.
  std::vector<Box> stack;                ///< The stack of timber, in pieces.

  /// The sensors along the path; `seed` of their noise: use another one for each drive.
  SensorDrive sensors(const SensorSuite& suite, const SpeedParameters& speed,
                      std::uint64_t seed) const {
    return {scenario, VehicleParameters{}, speed, suite, seed, utime_of_start};
  }
};

/// All drives and their truth.
struct ChangingForest {
  std::vector<ForestDrive> drives;
  std::vector<TreeTruth> trees;  ///< In order of id.
};

/// Between two drives exactly round(share * trees) of the standing trees are felled; new trees are
/// added as far as there is room. The same arguments give the same forest. Throws as make_course().
ChangingForest make_changing_forest(const ChangingForestParameters& parameters, std::uint64_t seed);

}  // namespace understory::sim::changes
