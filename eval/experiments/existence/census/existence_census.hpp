// eval existence-census: Big Woods at both censuses through keyframer, mapper and tracker.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::existence::census {

/// Adds `existence-census`.
void add_existence_census_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::existence::census
