// A car park: two or three landmarks in a scan, wheels and a laser with one plane.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "eval/harness/chain_drive.hpp"

namespace understory::eval::experiments::few_landmarks {

/// Everything of a drive but its seed. The laser sees half of the horizon, all beams at one
/// instant; there is no IMU.
struct FewLandmarksDrive {
  double spacing_m = 22.0;  ///< Between neighbouring trunks, about.
  double length_m = 220.0;  ///< Of the circle.
  int laps = 1;
  double speed_mps = 2.0;
  double rate_hz = 5.0;      ///< Of the laser.
  int walkers = 0;           ///< People beside the path, whom the extractor may take for trunks.
  double wheel_scale = 2.0;  ///< The wheels' errors, by those of sim::WheelParameters.
  std::filesystem::path config_dir = "deploy/config/planar";
  std::filesystem::path log;  ///< The readings with the truth, as a log; empty = none.
};

/// The poses of a channel as they came, each map aligned by itself.
struct LiveErrors {
  std::size_t poses = 0;
  double ate_m = 0.0;  ///< Root mean square.
  double largest_m = 0.0;
  double mean_nees = 0.0;  ///< With the first pose of each map held; 3 is exact.
};

/// What became of a drive.
struct FewLandmarksScore {
  std::size_t scans = 0;
  double landmarks = 0.0;    ///< Detections in a scan, mean.
  std::size_t updates = 0;   ///< Keyframes that the mapper got.
  std::size_t accepted = 0;  ///< Those with a place in the map.
  std::size_t wrong = 0;     ///< Accepted more than a metre off.
  std::size_t maps = 0;
  std::size_t coasting = 0;  ///< Scans with a pose by odometry alone.
  LiveErrors slam;           ///< SLAM_POSE of each scan, coasting or not.
  LiveErrors ekf;
  double odometry_ate_m = 0.0;   ///< ODOMETRY summed.
  double updates_ate_m = 0.0;    ///< Keyframes as they came.
  double keyframes_ate_m = 0.0;  ///< As estimated at the end.
};

/// Drives once through the chain of `config_dir`; `progress` as in harness::ChainOptions.
FewLandmarksScore drive(const FewLandmarksDrive& plan, std::uint64_t seed,
                        const std::function<void(double done)>& progress);

}  // namespace understory::eval::experiments::few_landmarks
