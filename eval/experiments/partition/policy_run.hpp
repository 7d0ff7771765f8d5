// A recorded drive through the mapper, cut by a policy.
#pragma once

#include <filesystem>
#include <vector>

#include "eval/experiments/partition/baseline.hpp"
#include "eval/experiments/partition/policies.hpp"
#include "eval/experiments/partition/recorded_drive.hpp"

namespace understory::eval::experiments::partition {

/// What it gave.
struct PolicyRun {
  std::vector<model::KeyframePose> condensed;  ///< At the end of the drive, as the mapper has them.
  /// After the drive: the stretches put together again and optimised as a whole.
  std::vector<model::KeyframePose> settled;
  DriveGraph graph;                ///< Of `settled`.
  std::vector<model::Utime> cuts;  ///< Of the keyframes with which a stretch begins.
  double partition_ms = 0.0;       ///< What a cut adds to the time of its keyframe, mean.
  double iteration_ms = 0.0;       ///< Mean time of the other keyframes.
  double iteration_ms_p99 = 0.0;   ///< Of all keyframes.
  double joining_s = 0.0;          ///< The slowest keyframe that joined two passes.
  double settling_s = 0.0;         ///< Expansion and solution after the drive.
  double resident_mb = 0.0;        ///< Of the process at the end of the drive.
  std::size_t stored_bytes = 0;    ///< Of all stretches.
  double mean_nees = 0.0;          ///< Of the keyframes as they were told at once; 3 is exact.
  std::size_t refused = 0;         ///< Keyframes that were not fused.
};

/// Parameters of the mapper for ideal drives.
geoslam_mapper::SmoothingMapperParameters ideal_parameters();
/// Those of a configuration folder.
geoslam_mapper::SmoothingMapperParameters configured_parameters(const std::filesystem::path& dir);

/// Maps the drive. Throws std::runtime_error where the drive put together is not determined.
PolicyRun map_drive(const RecordedDrive& drive, const Policy& policy,
                    geoslam_mapper::SmoothingMapperParameters parameters);

}  // namespace understory::eval::experiments::partition
