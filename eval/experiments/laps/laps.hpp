// eval laps: the same way driven again and again; what must not grow, and what must not get worse.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "eval/harness/sensor_chain.hpp"

namespace understory::eval::experiments::laps {

/// What is driven and how it is mapped.
struct LapsOptions {
  std::uint64_t seed = 1;
  int laps = 15;
  double length_m = 1000.0;  ///< Of a lap: a circle in a forest.
  int beams = 16;            ///< Of the LIDAR: 16 or 32.
  double hours = 0.0;        ///< Further hours from the recorded LANDMARKS and ODOMETRY.
  std::filesystem::path config_dir = "deploy/config/lidar";
  /// The map of the recorded lap is written to this file, and in the hours nothing but localising
  /// in it is done; empty: the hours map from nothing.
  std::filesystem::path localise_in;
  double known_ground_m = -1.0;  ///< Instead of the mapper's parameter; negative: as configured.
  std::string json;
  bool plots = true;
};

/// One lap, or one stretch of the hours that follow.
struct Lap {
  int number = 0;         ///< From 1.
  double hours = 0.0;     ///< Of driving, at its end.
  double heap_mib = 0.0;  ///< In use at its end, of all stages together, without the recorded lap.
  double mapper_state_mib = 0.0;  ///< As the mapper saves itself.
  double mapper_p99_ms = 0.0;
  double mapper_largest_ms = 0.0;
  double ate_m = 0.0;      ///< RMS of SLAM_POSE in the frame of the first pose.
  double mean_nees = 0.0;  ///< Of SLAM_POSE; 3 is exact. 0 in the hours that follow.
  double largest_nees = 0.0;
  std::size_t poses = 0;  ///< Localised.
  std::size_t unsure = 0;
  std::size_t keyframes = 0;  ///< Accepted.
  std::size_t refused = 0;
};

/// Messages of the last whole lap, to be repeated.
struct RecordedLap {
  std::vector<harness::RawMessage> messages;  ///< In order of arrival.
};

/// Drives the laps from raw LIDAR. The last lap but one is recorded. `done` is called after each
/// lap.
std::vector<Lap> drive_laps(const LapsOptions& options, const std::atomic<bool>& stop,
                            RecordedLap& recorded, const std::function<void(const Lap&)>& done);

/// Makes the map of the recorded lap and writes it to `options.localise_in`, unless it is there.
/// Throws std::runtime_error where a lap gives no map, map_file::MapFileError.
void write_lap_map(const LapsOptions& options, const RecordedLap& recorded);

/// Repeats what was recorded for `options.hours` through keyframer and mapper, from an empty map or
/// in the one of `options.localise_in`. A row for each half hour. `map_changes`: counts MAP_DELTA.
std::vector<Lap> repeat_lap(const LapsOptions& options, const std::atomic<bool>& stop,
                            const RecordedLap& recorded, std::uint64_t& map_changes,
                            const std::function<void(const Lap&)>& done);

/// Adds `laps`.
void add_laps_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::laps
