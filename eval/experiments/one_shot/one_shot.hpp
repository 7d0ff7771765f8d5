// eval one-shot: single scans in surveyed stem maps, each located on its own.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::one_shot {

/// Adds `one-shot`: six surveyed maps, and one of thickets whose stems stand closer together than
/// they are observed exactly.
void add_one_shot_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::one_shot
