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
  std::function<geometry::SE2(model::Utime)> world_T_vehicle;
  std::vector<Eigen::Vector2d> trunks_m;  ///< Frame `world`, at breast height.
  std::vector<std::uint32_t>
      observation_count_of_trunk;  ///< Sweeps with returns enough to find it.
};

struct LidarResult {
  RunResult slam;  ///< The mapper's states.
  RunResult ekf;   ///< EKF_POSE at the same places, as it was said then; without landmarks.
};

/// The errors of `run.states` as run_slam() takes them: in the frame of the first keyframe's base,
/// nothing aligned. Places and states of a vehicle that stands count once in the errors; updates
/// are counted all. Empty where there is no map.
LidarResult score_chain(const ChainRun& run, const ChainTruth& truth);

/// Drives a car with 32 beams at 10 Hz along the drive's path, a sweep every 0.2 m, from its start
/// among its trunks (without those that are in a car's way); corners are rounded as a car must.
/// No GNSS. Everything else follows from `seed`.
LidarResult run_lidar(const sim::Drive& drive, const std::filesystem::path& config_dir,
                      std::uint64_t seed, const std::atomic<bool>& stop);

}  // namespace understory::eval::harness
