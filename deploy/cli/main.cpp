// `understory`: the front door. Exit status: 0 done, 1 the work failed, 2 wrong usage.
#include "common/bus/process_memory.hpp"
#include "common/model/program_version.hpp"
#include "common/terminal/command_line.hpp"
#include "deploy/cli/commands.hpp"

int main(int argc, char** argv) {
  understory::bus::keep_freed_memory();
  CLI::App app{"Localisation and mapping among landmarks that all look alike.", "understory"};
  app.require_subcommand(1);
  app.set_version_flag("--version", understory::model::program_version());

  understory::cli::add_launch_command(app);
  understory::cli::add_sim_command(app);
  understory::cli::add_status_command(app);
  understory::cli::add_replay_command(app);
  understory::cli::add_eval_command(app);
  understory::cli::add_doctor_command(app);
  understory::cli::add_import_command(app);
  understory::cli::add_export_command(app);
  understory::cli::add_report_command(app);
  understory::cli::add_log_command(app);
  understory::cli::add_why_command(app);
  understory::cli::add_map_command(app);
  understory::cli::add_loop_command(app);
  understory::cli::add_view_command(app);
  return understory::terminal::run_command_line(app, argc, argv);
}
