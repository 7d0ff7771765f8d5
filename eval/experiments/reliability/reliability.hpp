// What the system promises when messages and processes are late.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::reliability {

/// Adds `understory eval reliability`.
void add_reliability_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::reliability
