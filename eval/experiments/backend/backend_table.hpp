// Rows of `eval backend`: as JSON and as text.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "eval/experiments/backend/backend.hpp"

namespace understory::eval::experiments::backend {

/// A run's row of the result document, with what is known of the graph from elsewhere: the field's
/// reference, and the stored optimum with its source.
nlohmann::json row_of(const BackendRun& run);
/// What a row's trace file holds: times per update and the moments, one by one.
nlohmann::json trace_of(const BackendRun& run);
/// Prints the columns' names.
void print_heading();
/// Prints a row of row_of().
void print_row(const nlohmann::json& row);

}  // namespace understory::eval::experiments::backend
