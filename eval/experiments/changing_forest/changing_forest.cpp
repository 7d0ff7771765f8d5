#include "eval/experiments/changing_forest/changing_forest.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "common/bus/config_layers.hpp"
#include "common/bus/launch_config.hpp"
#include "eval/harness/drive_map.hpp"

namespace understory::eval::experiments::changing_forest {
namespace {

namespace changes = sim::changes;

constexpr const char* kMapper = "geoslam_mapper";
constexpr const char* kTracker = "existence_tracker";
/// A landmark is a tree's when it is nearer to it than this [m].
constexpr double kSameM = 0.5;

/// Nearer than this to the vehicle, what nothing hides is seen [m].
constexpr double kSurelySeenM = 15.0;
/// Above the ground, of the rays to trunks [m].
constexpr double kEyeM = 1.5;

/// Parameter files of the processes that begin with the map (none where the path is empty), by
/// process.
std::map<std::string, std::string> parameters_for(const DrivesOptions& options, Keeping keeping,
                                                  const std::filesystem::path& map) {
  std::map<std::string, std::string> result;
  for (const char* const process : {kMapper, kTracker}) {
    toml::table values;
    if (!map.empty()) values.insert("input", toml::table{{"map_file", map.string()}});
    if (process == kTracker && keeping == Keeping::kWithoutRanges)
      values.insert("looks", toml::table{{"use_ranges", false}});
    result[process] = bus::layer_over(bus::config_file_in(options.config_dir, process), values);
  }
  return result;
}

bool is_behind(const sim::Box& box, const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) {
  const double eye_m = box.centre_m.z() - box.half_size_m.z() + kEyeM;
  const Eigen::Vector2d way_m = to_m - from_m;
  const sim::Ray ray{{from_m.x(), from_m.y(), eye_m},
                     Eigen::Vector3d(way_m.x(), way_m.y(), 0.0).normalized()};
  const auto hit = sim::meet(ray, box);
  return hit && hit->range_m < way_m.norm();
}

/// Whether the stack hides a tree from wherever the drive came near it.
bool is_hidden(const std::vector<sim::Box>& stack, const Eigen::Vector2d& tree_m,
               const harness::ChainRun& run) {
  bool came_near = false;
  for (const metrics::StampedPose& pose : run.truth) {
    const Eigen::Vector2d from_m = pose.pose.translation();
    if ((from_m - tree_m).norm() > kSurelySeenM) continue;
    came_near = true;
    if (std::ranges::none_of(stack,
                             [&](const sim::Box& box) { return is_behind(box, from_m, tree_m); })) {
      return false;
    }
  }
  return came_near;
}

/// World from map, by the truth along the drive.
geometry::SE2 world_T_map(const harness::ChainRun& run) {
  const model::SlamPose& last = run.slam.back();
  return *metrics::pose_at(run.truth, last.utime) * last.map_T_vehicle().inverse();
}

double distance_to_path(const Eigen::Vector2d& at_m, const harness::ChainRun& run) {
  double nearest_m = 1e9;
  for (const metrics::StampedPose& pose : run.truth)
    nearest_m = std::min(nearest_m, (pose.pose.translation() - at_m).norm());
  return nearest_m;
}

std::vector<PlacedLandmark> placed_landmarks(const harness::ChainRun& run, double beside_m) {
  std::vector<PlacedLandmark> result;
  const geometry::SE2 to_world = world_T_map(run);
  for (const model::MapLandmark& landmark : run.landmarks) {
    const Eigen::Vector2d world_m = to_world * landmark.position_m;
    if (distance_to_path(world_m, run) > beside_m) continue;
    const auto existence = run.existence.find(landmark.id);
    if (existence == run.existence.end()) {
      result.push_back({world_m});
    } else {
      result.push_back({world_m, existence->second.probability, existence->second.is_in_use});
    }
  }
  return result;
}

bool is_at(const Eigen::Vector2d& a_m, const Eigen::Vector2d& b_m) {
  return (a_m - b_m).norm() < kSameM;
}

DriveMap map_of(const harness::ChainRun& run, const changes::ChangingForest& forest, int drive,
                double beside_m) {
  DriveMap map;
  map.stack = forest.drives[static_cast<std::size_t>(drive)].stack;
  map.landmarks = placed_landmarks(run, beside_m);
  for (const metrics::StampedPose& pose : run.truth) map.path_m.push_back(pose.pose.translation());
  for (const changes::TreeTruth& tree : forest.trees) {
    const double aside_m = distance_to_path(tree.position_m, run);
    if (tree.first_drive > drive || aside_m > beside_m + kSameM) continue;
    map.trees.push_back({tree.position_m, tree.stands_in(drive),
                         is_hidden(map.stack, tree.position_m, run), aside_m <= beside_m});
  }
  return map;
}

/// `is_used`, `is_unused`: landmarks that are in use, and out of use, stand where the tree does.
void count(const PlacedTree& tree, bool is_used, bool is_unused, DriveScore& score) {
  const bool is_there = is_used || is_unused;
  if (tree.stands) {
    ++score.standing;
    score.found += is_used ? 1 : 0;
    score.wrongly_unused += is_unused && !is_used ? 1 : 0;
  } else if (is_there) {
    ++score.felled;
    score.felled_unused += is_used ? 0 : 1;
    score.felled_hidden += tree.is_hidden ? 1 : 0;
    score.felled_hidden_unused += tree.is_hidden && !is_used ? 1 : 0;
  }
  if (tree.stands && is_there && tree.is_hidden) {
    ++score.hidden;
    score.hidden_unused += is_used ? 0 : 1;
  }
}

void count_map(const DriveMap& map, DriveScore& score) {
  for (const PlacedTree& tree : map.trees) {
    if (!tree.counts) continue;
    const auto has = [&](bool in_use) {
      return std::ranges::any_of(map.landmarks, [&](const PlacedLandmark& one) {
        return one.is_in_use == in_use && is_at(one.world_m, tree.world_m);
      });
    };
    count(tree, has(true), has(false), score);
  }

  for (const PlacedLandmark& one : map.landmarks) {
    if (!one.is_in_use) continue;
    ++score.in_use;
    score.right += std::ranges::any_of(map.trees, [&](const PlacedTree& tree) {
      return tree.stands && is_at(tree.world_m, one.world_m);
    });
  }
}

DriveScore score_of(const harness::ChainRun& run, const changes::ChangingForest& forest, int drive,
                    double beside_m) {
  DriveScore score;
  score.drive = drive;
  score.stored = run.landmarks.size();
  score.ate_m = harness::trajectory_error(run.slam, run.truth).ate_rms_m;
  score.signals = run.mapping_signals;
  const harness::FalseDetectionCounts& counts = run.false_detections;
  if (counts.detections > 0)
    score.false_share = static_cast<double>(counts.clutter + counts.of_things) /
                        static_cast<double>(counts.detections);
  score.map = map_of(run, forest, drive, beside_m);
  count_map(score.map, score);
  return score;
}

}  // namespace

changes::ChangingForest forest_for(Part part, const DrivesOptions& options, std::uint64_t seed) {
  changes::ChangingForestParameters parameters = options.forest;
  if (part == Part::kStack) parameters.stack_m = options.stack_m;
  if (part == Part::kFalseDetections) parameters.share = 0.0;
  return changes::make_changing_forest(parameters, seed);
}

std::vector<DriveScore> drive_forest(const changes::ChangingForest& forest,
                                     const DrivesOptions& options, const Variant& variant,
                                     std::uint64_t seed, const std::filesystem::path& scratch,
                                     const std::function<void(double)>& progress) {
  std::vector<DriveScore> scores;
  std::filesystem::path map;
  const auto drives = static_cast<double>(forest.drives.size());
  for (std::size_t i = 0; i < forest.drives.size(); ++i) {
    sim::SensorSuite suite;
    suite.gnss.reset();
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
    suite.lidar->columns = options.columns;
    sim::SensorDrive sensors = forest.drives[i].sensors(suite, {}, seed + i);

    harness::ChainOptions chain;
    chain.config_dir = options.config_dir;
    chain.toml_instead = parameters_for(options, variant.keeping, map);
    if (variant.keeping == Keeping::kNothing) chain.without = {kTracker};
    chain.false_detections.share = variant.false_share;
    chain.false_detections.seed = seed + i;
    chain.progress = [&](double done) { progress((static_cast<double>(i) + done) / drives); };
    const harness::ChainRun run = harness::drive_chain(sensors, chain);

    scores.push_back(score_of(run, forest, static_cast<int>(i), options.beside_m));
    map = scratch / ("drive-" + std::to_string(i) + ".gpkg");
    harness::write_drive_map(run, "forest", map);
  }
  return scores;
}

}  // namespace understory::eval::experiments::changing_forest
