// eval existence-drives: a forest is mapped once and driven again while its trees go and come, from
// raw LIDAR through the whole chain.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "eval/harness/chain_drive.hpp"
#include "sim/changes/changing_forest.hpp"

namespace understory::eval::experiments::changing_forest {

/// What happens between drives and on them.
enum class Part : std::uint8_t {
  kChanges,          ///< Trees are felled, and others grow.
  kStack,            ///< A stack of timber hides trees besides, from the second drive on.
  kFalseDetections,  ///< Nothing changes; some of the detections are of no landmark.
};

/// How the map goes from drive to drive.
enum class Keeping : std::uint8_t {
  kTracker,        ///< With the existence tracker and its states.
  kWithoutRanges,  ///< The same, but it does not hear what the sensor measured along the rays.
  kNothing,        ///< Without: the map only grows.
};

/// One way through all drives of a forest.
struct Variant {
  Part part = Part::kChanges;
  Keeping keeping = Keeping::kTracker;
  double false_share = 0.0;  ///< Of all detections.
};

/// A landmark of the map, where it is in the world.
struct PlacedLandmark {
  Eigen::Vector2d world_m;
  double probability = 1.0;  ///< As EXISTENCE states; 1 where it says nothing.
  bool is_in_use = true;
};

/// A tree as it is on a drive.
struct PlacedTree {
  Eigen::Vector2d world_m;
  bool stands = true;      ///< Else it was felled.
  bool is_hidden = false;  ///< Behind the stack, from wherever the drive came near it.
  bool counts = true;      ///< Else it stands just outside: a landmark beside the path may be its.
};

/// The map after a drive and what is really there, beside the path.
struct DriveMap {
  std::vector<Eigen::Vector2d> path_m;
  std::vector<PlacedLandmark> landmarks;
  std::vector<PlacedTree> trees;  ///< Those that stand or stood.
  std::vector<sim::Box> stack;
};

/// One drive against the truth.
struct DriveScore {
  int drive = 0;
  std::size_t standing = 0;              ///< Trees beside the path that stand.
  std::size_t found = 0;                 ///< Those that the map in use has.
  std::size_t in_use = 0;                ///< Landmarks in use beside the path ...
  std::size_t right = 0;                 ///< ... and those of them where a tree stands.
  std::size_t stored = 0;                ///< Landmarks of the map, in use or not.
  std::size_t felled = 0;                ///< Trees that were mapped and do not stand any more ...
  std::size_t felled_unused = 0;         ///< ... and are out of use.
  std::size_t wrongly_unused = 0;        ///< Landmarks out of use where a tree stands.
  std::size_t hidden = 0;                ///< Standing trees of the map that the stack hides ...
  std::size_t hidden_unused = 0;         ///< ... and are out of use.
  std::size_t felled_hidden = 0;         ///< Of `felled`, those that the stack would hide ...
  std::size_t felled_hidden_unused = 0;  ///< ... and that are out of use all the same.
  double false_share = 0.0;              ///< Of the detections of the drive.
  double ate_m = 0.0;
  std::vector<harness::MappingSignal> signals;  ///< As EXISTENCE states, keyframe by keyframe.
  DriveMap map;
};

/// What a run of drives is.
struct DrivesOptions {
  std::filesystem::path config_dir = "deploy/config/lidar";
  sim::changes::ChangingForestParameters forest;
  double beside_m = 15.0;  ///< Trees and landmarks within this of the path count.
  int columns = 1200;      ///< Of the LIDAR.
  double stack_m = 40.0;   ///< Of timber, in kStack.
};

/// The forest of a part.
sim::changes::ChangingForest forest_for(Part part, const DrivesOptions& options,
                                        std::uint64_t seed);

/// All drives of one forest, the map of each given to the next as a map file in `scratch`.
/// `progress` is told how much is done, 0 to 1. Throws as drive_chain() and map files do.
std::vector<DriveScore> drive_forest(const sim::changes::ChangingForest& forest,
                                     const DrivesOptions& options, const Variant& variant,
                                     std::uint64_t seed, const std::filesystem::path& scratch,
                                     const std::function<void(double)>& progress);

/// Adds `existence-drives`.
void add_changing_forest_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::changing_forest
