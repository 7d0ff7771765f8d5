// eval map-merge: pairs of maps that overlap, or do not, merged without a prior.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::merges {

/// Adds `map-merge`: maps cut out of surveyed forests, and maps of simulated drives.
void add_map_merge_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::merges
