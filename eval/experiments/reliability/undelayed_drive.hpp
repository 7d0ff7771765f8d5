// The drive that a drive with delays is compared with.
#pragma once

#include <filesystem>

#include "eval/experiments/reliability/live_drive.hpp"
#include "eval/experiments/reliability/sensor_tape.hpp"

namespace understory::eval::experiments::reliability {

/// The same tape through the stages in one process, each message as soon as it is there: the poses
/// that no delay has touched. HEALTH is not heard. About 15 s of processor time for a drive of four
/// minutes.
LiveDrive play_undelayed(const SensorTape& tape, std::size_t faults,
                         const std::filesystem::path& config_dir);

}  // namespace understory::eval::experiments::reliability
