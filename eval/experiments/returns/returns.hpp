// eval returns: a drive that drifts, comes back near itself and has to know again what it mapped.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <vector>

#include "sim/forest.hpp"

namespace understory::eval::experiments::returns {

/// One drive: laps round a surveyed forest. On a stretch of the first lap no trunk is detected, so
/// that odometry drifts there by about `drift_m` until the way comes back near itself.
struct ReturnDrive {
  double drift_m = 20.0;     ///< 1 sigma of the drift at the first return, as odometry states it.
  double seen_share = 0.64;  ///< Of the trunks; drawn anew for each lap.
  double sigma_m = 0.15;     ///< Of a detection, per axis; a keyframe has eight scans.
  double range_m = 20.0;
  double blind_share = 0.3;  ///< Of the first lap.
  int laps = 3;
};

/// What became of it.
struct ReturnScore {
  double drift_m = 0.0;        ///< Error of the pose at the end of the first lap.
  int false_merges = 0;        ///< Merges of landmarks of different trunks.
  int merges = 0;              ///< All merges.
  int revoked = 0;             ///< Merges that were taken back.
  int doubled = 0;             ///< Trunks that had two landmarks or more.
  int joined = 0;              ///< Of these: have one at the end of the second lap after.
  int trunks = 0;              ///< With a landmark at the end.
  int false_associations = 0;  ///< Observations given to the landmark of another trunk.
  int associations = 0;
  int keyframes = 0;
  int refused = 0;  ///< Of the keyframes.
  double first_closure_m =
      -1.0;                   ///< Path on known ground until the error was below 1 m; -1: never.
  double ate_m = 0.0;         ///< RMS of the poses at the end, first pose held.
  double last_error_m = 0.0;  ///< Of the last pose.
  double mean_nees = 0.0;     ///< Of the poses of the last lap as they were told; 3 is exact.
  double largest_nees = 0.0;
  double p99_ms = 0.0;
  double largest_ms = 0.0;
};

/// Drives it, round the forest without the stems that nearly touch another one (0.3 m: one tree for
/// a sensor); the same seed gives the same score but for the times.
ReturnScore drive(const ReturnDrive& drive, const sim::Forest& forest, std::uint64_t seed);

/// Adds `returns`.
void add_returns_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::returns
