// A drive through real processes on a bus of their own, at the speed at which it was driven.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "eval/experiments/reliability/fault.hpp"
#include "eval/experiments/reliability/pose_judge.hpp"
#include "eval/experiments/reliability/sensor_tape.hpp"

namespace understory::eval::experiments::reliability {

/// How a drive is played.
struct LiveOptions {
  std::filesystem::path config_dir = "deploy/config/lidar";
  bool supervised = false;  ///< By `understory launch`; else nobody restarts what is stopped.
};

/// What was heard.
struct LiveDrive {
  std::vector<SaidPose> slam;
  std::vector<SaidPose> filter;
  std::uint64_t lost = 0;           ///< Messages, by the counts of HEALTH.
  std::vector<double> latency_ms;   ///< SLAM_POSE behind the end of its sweep, outside of faults.
  std::vector<std::string> not_ok;  ///< Of each fault: what HEALTH said, where it was not OK.
};

/// Names of the processes of a configuration. Throws ConfigurationError.
std::vector<std::string> processes_of(const std::filesystem::path& config_dir);

/// Plays the tape. Throws std::runtime_error where the processes do not come up.
LiveDrive play(const SensorTape& tape, std::span<const Fault> faults, const LiveOptions& options);

}  // namespace understory::eval::experiments::reliability
