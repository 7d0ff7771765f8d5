// The subcommands of `understory`, one file each. On failure a command prints one line to stderr
// that names the file, channel or key, and throws CLI::RuntimeError(1); wrong usage ends with 2.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

void add_doctor_command(CLI::App& parent);
void add_export_command(CLI::App& parent);
void add_import_command(CLI::App& parent);
void add_launch_command(CLI::App& parent);
void add_log_command(CLI::App& parent);
void add_replay_command(CLI::App& parent);
void add_sim_command(CLI::App& parent);
void add_status_command(CLI::App& parent);

}  // namespace understory::cli
