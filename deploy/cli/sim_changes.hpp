// `understory sim changes`.
#pragma once

#include <CLI/App.hpp>

namespace understory::cli {

/// Adds `changes`: one path through several copies of a world, as a data set with the true changes.
void add_changes_simulation(CLI::App& sim);

}  // namespace understory::cli
