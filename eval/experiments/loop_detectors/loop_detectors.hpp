// eval loop-detectors: every detector and every verifier of thesis 002 §2.4 on the same queries.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::loop_detectors {

/// Adds `loop-detectors`.
void add_loop_detectors_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::loop_detectors
