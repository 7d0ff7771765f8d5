// `understory eval shared-errors`.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::shared_errors {

/// Adds `shared-errors`: drives through surveyed forests whose detections share errors from frame
/// to frame, through keyframer, mapper and loop closer, beside the batch solution.
void add_shared_errors_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::shared_errors
