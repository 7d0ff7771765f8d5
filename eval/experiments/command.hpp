// `understory-eval`: the experiments on the command line.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments {

/// Adds one subcommand per experiment. Each runs while the command line is parsed, like CLI11's
/// callbacks do, and throws CLI::RuntimeError with the exit status where it is not 0.
void add_experiments(CLI::App& eval);

}  // namespace understory::eval::experiments
