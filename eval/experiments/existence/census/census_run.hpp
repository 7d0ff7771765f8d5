// A real forest at two censuses, driven through the mapper and the existence tracker.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "eval/experiments/existence/forest.hpp"

namespace understory::eval::experiments::existence::census {

/// How the processes are run.
struct CensusOptions {
  std::filesystem::path config_dir = "deploy/config/lidar";
  ForestSetting forest;
  double decay_per_s = 8e-10;  ///< Learned from trees elsewhere.
  double decay_weight = 20.0;  ///< What it counts for, in trees.
  bool use_ranges = true;      ///< VIEW_RANGES are sent.
  bool share_errors = false;   ///< Detections share errors from scan to scan.
  /// The map file states how sure each landmark is in the frame of the first keyframe (0.7 m at the
  /// far end), and the next drive takes that for an error of each by itself. Else it states
  /// nothing, and `smoothing.given_map_sigma_m` counts.
  bool state_covariances = false;
  /// Folder that keeps the inputs of each drive as a log, and the map after it; empty: none.
  std::filesystem::path logs;
};

/// A stem of the first map, after a drive.
struct MappedStem {
  std::uint32_t stem = 0;
  double probability = 0.0;  ///< As EXISTENCE states; of several landmarks the most, 0: removed.
  bool is_in_use = false;
};

/// What the processes say after a drive.
struct CensusAfterDrive {
  std::vector<MappedStem> stems;  ///< Those of the first drive's map, in order.
  std::size_t landmarks = 0;      ///< Of the map.
  std::size_t in_use = 0;
  std::size_t recruits_in_use = 0;  ///< Stems that are new at the second census.
  std::size_t ghosts_in_use = 0;    ///< Landmarks of stems that do not stand.
  std::size_t doubles_in_use = 0;   ///< Landmarks of stems that have another one in use.
  std::size_t updates = 0;          ///< Keyframes,
  std::size_t placed = 0;           ///< and those of them that were placed in the map.
  std::size_t maps = 0;             ///< In which they were.
  double ate_m = 0.0;
};

/// All drives, and the same looks for methods that are no process. Stems that are new at the second
/// census are points of the history that no mapping drive sees.
struct CensusRun {
  History history;
  std::vector<CensusAfterDrive> after;  ///< By drive, the mapping one first.
};

/// The first drive maps, each other one begins with the map file of the one before (in `scratch`).
/// `progress` is told how much is done, 0 to 1. Throws as SensorChain and map files do.
CensusRun run_census(const std::vector<CensusStem>& stems, const CensusOptions& options,
                     std::uint64_t seed, const std::filesystem::path& scratch,
                     const std::function<void(double)>& progress);

}  // namespace understory::eval::experiments::existence::census
