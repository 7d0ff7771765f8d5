// `understory`: the front door. Exit status: 0 done, 1 the work failed, 2 wrong usage.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "common/bus/process_memory.hpp"
#include "deploy/cli/commands.hpp"
#include "eval/experiments/command.hpp"

namespace {

int run(int argc, char** argv) {
  CLI::App app{"Localisation and mapping among landmarks that all look alike.", "understory"};
  app.require_subcommand(1);
  app.set_version_flag("--version", UNDERSTORY_VERSION);
  understory::cli::add_launch_command(app);
  understory::cli::add_sim_command(app);
  understory::cli::add_status_command(app);
  understory::cli::add_replay_command(app);

  understory::eval::experiments::add_eval_command(app);
  understory::cli::add_doctor_command(app);
  understory::cli::add_import_command(app);
  understory::cli::add_export_command(app);
  understory::cli::add_report_command(app);
  understory::cli::add_log_command(app);
  understory::cli::add_why_command(app);
  understory::cli::add_map_command(app);
  understory::cli::add_loop_command(app);
  understory::cli::add_view_command(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == 0;
    app.exit(error);
    return asked_for_help ? 0 : 2;
  }

  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  understory::bus::keep_freed_memory();
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "understory: {}\n", error.what());
    return 1;
  }
}
