// `understory eval loops`.
#pragma once

#include <CLI/App.hpp>
#include <string>

namespace understory::eval::experiments::loops {

/// The name of a drive: that of its folder.
std::string name_of(const std::string& folder);

/// Adds `loops`: drives of stem frames with the loop closer, without it, and the batch solution.
void add_loops_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::loops
