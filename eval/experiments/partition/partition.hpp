// What partition of the map costs and gives: a drive with condensed stretches beside the same drive
// without (thesis on submaps, chapter 5).
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <vector>

#include "eval/experiments/partition/route.hpp"

namespace understory::eval::experiments::partition {

/// One part of a drive.
struct Section {
  double end_m = 0.0;
  double ms_p50 = 0.0;  ///< Of the mapper, per keyframe.
  double ms_p99 = 0.0;
  double ms_max = 0.0;
  double resident_mb = 0.0;  ///< Of the whole process, at the section's end.
  double mapper_mb = 0.0;    ///< That the mapper alone has on the heap, likewise.
};

/// How the mapper keeps what lies behind.
struct Keeping {
  double size_m = 0.0;       ///< Stretches that are condensed; 0: none.
  double hand_over_m = 0.0;  ///< What is farther away goes to the disk; 0: nothing.
};

/// What a drive gave.
struct DriveResult {
  std::vector<geometry::SE2> trajectory;  ///< At the end; by keyframe.
  double rmse_to_truth_m = 0.0;           ///< First pose held.
  double mean_nees = 0.0;                 ///< Of the keyframes as they were told at once.
  std::size_t refused = 0;                ///< Keyframes that were not fused.
  std::size_t landmarks = 0;
  double closure_ms = 0.0;       ///< The slowest keyframe that joined two passes.
  std::size_t disk_bytes = 0;    ///< Of the submaps on the disk at the end.
  std::size_t brought_back = 0;  ///< Submaps, from the disk.
  std::vector<Section> sections;
};

/// Drives the route. `sections` parts of it are timed by themselves. Throws terminal::Interrupted.
DriveResult drive(const RouteParameters& route, std::uint64_t seed, const Keeping& keeping,
                  std::size_t sections);

/// RMS distance of two trajectories, first pose held [m].
double rmse_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b);

/// Adds `long-drive` and `long-drive-loop`.
void add_long_drive_experiments(CLI::App& eval);
/// Adds `partition`, `partition-loop`, `partition-dynamic` and `partition-dynamic-loop`.
void add_partition_experiments(CLI::App& eval);

}  // namespace understory::eval::experiments::partition
