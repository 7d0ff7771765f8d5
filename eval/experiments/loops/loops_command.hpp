// `understory eval loops`.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::loops {

/// Adds `loops`: drives of stem frames with the loop closer, without it, and the batch solution.
void add_loops_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::loops
