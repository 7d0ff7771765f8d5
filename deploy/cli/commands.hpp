// The subcommands of `understory`, one file each. On failure a command prints one line to stderr
// with the file, channel or key, and throws CLI::RuntimeError(1); wrong usage ends with 2.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// `understory doctor`: checks this computer.
void add_doctor_command(CLI::App& parent);
/// `understory eval`: runs the experiments of `understory-eval`.
void add_eval_command(CLI::App& parent);
/// `understory export`: results in formats of other tools.
void add_export_command(CLI::App& parent);
/// `understory import`: converts another program's recording into an LCM log.
void add_import_command(CLI::App& parent);
/// `understory launch`: starts, watches and restarts the processes.
void add_launch_command(CLI::App& parent);
/// `understory log`: recording, information, checks, repair and cuts of logs.
void add_log_command(CLI::App& parent);
/// `understory loop`: loop closures set and revoked by hand.
void add_loop_command(CLI::App& parent);
/// `understory map`: stored maps: contents, checks, imports, exports, history.
void add_map_command(CLI::App& parent);
/// `understory replay`: runs a log through chosen services.
void add_replay_command(CLI::App& parent);
/// `understory report`: writes a drive as one HTML file.
void add_report_command(CLI::App& parent);
/// `understory sim`: a simulated drive.
void add_sim_command(CLI::App& parent);
/// `understory status`: HEALTH of all processes.
void add_status_command(CLI::App& parent);
/// `understory view`: the viewer's page over logs and stored maps.
void add_view_command(CLI::App& parent);
/// `understory why`: explains the origin of a landmark or a pose of a log.
void add_why_command(CLI::App& parent);

}  // namespace understory::cli
