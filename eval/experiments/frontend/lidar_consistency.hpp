// Consistency of the filter behind simulated sensors: drives through the chain up to
// EKF_POSE, errors against the filter's own covariance.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "eval/experiments/frontend/ekf_consistency.hpp"
#include "eval/experiments/frontend/frontend.hpp"

namespace understory::eval::experiments::frontend {

/// A forest drive that begins stationary.
struct LidarDriveOptions {
  std::filesystem::path config_dir;  ///< Of the chain's services.
  double duration_s = 60.0;          ///< Including the stationary start.
  double stationary_s = 22.0;        ///< The stage needs 20 s to estimate its biases.
  double length_m = 250.0;           ///< Of the circle.
  bool has_wheels = true;
  std::function<void()> progress;  ///< Called at every sweep.
};

/// One drive: EKF_POSE at the sweeps. Times of updates and velocities are not taken.
EkfDriveResult run_lidar_drive(const LidarDriveOptions& options, std::uint64_t seed);

/// Some such drives, with wheels and without.
void add_lidar_filter_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                           FrontendRows& rows);

}  // namespace understory::eval::experiments::frontend
