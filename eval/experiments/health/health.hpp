// Does HEALTH say so where the pose is wrong, and nothing where it is right?
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::health {

/// Adds `understory eval health`.
void add_health_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::health
