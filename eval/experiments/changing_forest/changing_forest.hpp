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

/// How the map goes from drive to drive.
enum class Keeping {
  kTracker,  ///< With the existence tracker and its states.
  kNothing,  ///< Without: the map only grows.
};

/// One drive against the truth.
struct DriveScore {
  int drive = 0;
  std::size_t standing = 0;        ///< Trees beside the path that stand.
  std::size_t found = 0;           ///< Those that the map in use has.
  std::size_t in_use = 0;          ///< Landmarks in use beside the path ...
  std::size_t right = 0;           ///< ... and those of them where a tree stands.
  std::size_t stored = 0;          ///< Landmarks of the map, in use or not.
  std::size_t felled = 0;          ///< Trees that were mapped and do not stand any more ...
  std::size_t felled_unused = 0;   ///< ... and are out of use.
  std::size_t wrongly_unused = 0;  ///< Landmarks out of use where a tree stands.
  double ate_m = 0.0;
  double missing_share = 0.0;  ///< As EXISTENCE states at the end.
  bool mapping_needed = false;
};

/// What a run of drives is.
struct DrivesOptions {
  std::filesystem::path config_dir = "deploy/config/lidar";
  sim::changes::ChangingForestParameters forest;
  double beside_m = 15.0;  ///< Trees and landmarks within this of the path count.
  int columns = 1200;      ///< Of the LIDAR.
};

/// All drives of one forest, the map of each given to the next as a map file in `scratch`.
/// `progress` is told how much is done, 0 to 1. Throws as drive_chain() and map files do.
std::vector<DriveScore> drive_forest(const sim::changes::ChangingForest& forest,
                                     const DrivesOptions& options, Keeping keeping,
                                     std::uint64_t seed, const std::filesystem::path& scratch,
                                     const std::function<void(double)>& progress);

/// Adds `existence-drives`.
void add_changing_forest_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::changing_forest
