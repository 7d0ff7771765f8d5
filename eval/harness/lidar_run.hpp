// One run of the whole chain, from simulated LIDAR, IMU and wheels, on the drive of a cell.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <vector>

#include "eval/harness/chain_drive.hpp"
#include "eval/harness/run.hpp"

namespace understory::eval::harness {

/// What the chain is scored against.
struct ChainTruth {
  std::function<geometry::SE2(model::Utime)> world_T_vehicle;  ///< True pose at a time.
  std::vector<Eigen::Vector2d> trunks_m;                       ///< Frame `world`, at breast height.
  std::vector<std::uint32_t>
      observation_count_of_trunk;  ///< Sweeps with returns enough to find it.
};

/// The two rows of one run through the chain.
struct LidarResult {
  RunResult slam;  ///< The mapper's states.
  RunResult ekf;   ///< EKF_POSE at the same places, as published then; without landmarks.
};

/// The errors of `run.states` as run_slam() takes them: in the frame of the first keyframe's base,
/// nothing aligned. Places and states of a stationary vehicle count once in the errors; all updates
/// are counted. Empty where there is no map.
LidarResult score_chain(const ChainRun& run, const ChainTruth& truth);

/// Drives a car with 32 beams at 10 Hz along the drive's path, a sweep every 0.2 m, from its start
/// among its trunks (without those within 2 m of its path); corners are rounded to what a car can
/// drive. No GNSS. Everything else follows from `seed`.
LidarResult run_lidar(const sim::Drive& drive, const std::filesystem::path& config_dir,
                      std::uint64_t seed, const std::atomic<bool>& stop);

}  // namespace understory::eval::harness
