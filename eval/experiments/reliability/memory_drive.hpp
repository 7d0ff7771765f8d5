// Plays a drive in one process, with or without held sensors.
#pragma once

#include <filesystem>
#include <span>

#include "eval/experiments/reliability/live_drive.hpp"
#include "eval/experiments/reliability/sensor_tape.hpp"

namespace understory::eval::experiments::reliability {

/// The tape through the stages in one process, each message as soon as it is there; what `faults`
/// hold comes at the end of their time, in one burst. Nothing stops. HEALTH is not heard: what is
/// wrong and not told is not counted. The same bytes each time. About 15 s of processor time for a
/// drive of four minutes.
LiveDrive play_in_memory(const SensorTape& tape, std::span<const Fault> faults,
                         const std::filesystem::path& config_dir);

}  // namespace understory::eval::experiments::reliability
