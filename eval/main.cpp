// `understory-eval`, also called as `understory eval`: the experiments.
#include <CLI/CLI.hpp>

#include "common/bus/process_memory.hpp"
#include "common/model/program_version.hpp"
#include "common/terminal/command_line.hpp"
#include "eval/experiments/command.hpp"

int main(int argc, char** argv) {
  understory::bus::keep_freed_memory();
  CLI::App app{"Experiments: tables beside published figures, JSON, plots.", "understory-eval"};
  app.set_version_flag("--version", understory::model::program_version());
  understory::eval::experiments::add_experiments(app);
  return understory::terminal::run_command_line(app, argc, argv);
}
