// The three routes of the thesis on submaps (§4.2.1, chapter 5), driven once for all policies.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

#include "eval/experiments/partition/recorded_drive.hpp"

namespace understory::eval::experiments::partition {

/// A route of the thesis: "urban" (a block of 710 m), "urban-countryside", "countryside".
struct NamedRoute {
  std::string name;
  double length_m = 1000.0;  ///< Of the drive; of "urban" at most one lap and 60 m.
};

/// Where the landmarks come from.
enum class FrontEnd : std::uint8_t {
  /// What a LIDAR could see in truth, with known noise, and odometry with known noise.
  kIdeal,
  kLidar,  ///< The whole chain of processes behind simulated sensors.
};

/// How drives are made, and where they are kept.
struct RecordingOptions {
  std::filesystem::path config_dir = "deploy/config/lidar";  ///< Of the chain's processes.
  std::filesystem::path folder;  ///< Drives are kept here and not made again; empty: not kept.
};

/// Drives along the route. Everything follows from `seed`. Throws what a service throws, and
/// terminal::Interrupted once `stop` is true.
RecordedDrive record(const NamedRoute& route, FrontEnd front_end, std::uint64_t seed,
                     const RecordingOptions& options, const std::atomic<bool>& stop);

}  // namespace understory::eval::experiments::partition
