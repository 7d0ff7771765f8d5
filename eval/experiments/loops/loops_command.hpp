// `understory eval loops`.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "eval/experiments/loops/loop_drive.hpp"

namespace understory::eval::experiments::loops {

/// --odometry-percent, --odometry-deg, --sigma-m. `drive` must outlive the command.
void add_noise_options(CLI::App& command, LoopDriveOptions& drive);

/// The name of a drive: that of its folder.
std::string name_of(const std::string& folder);

/// Adds `loops`: drives of stem frames with the loop closer, without it, and the batch solution.
void add_loops_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::loops
