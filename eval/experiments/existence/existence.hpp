// eval existence: which points of an old map still exist?
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::existence {

/// Adds `existence`: point worlds that change, occluders, a clear-cut, a real forest at two dates.
void add_existence_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::existence
