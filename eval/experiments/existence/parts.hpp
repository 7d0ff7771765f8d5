// The parts of the experiment: rows of the result document and what the plots draw.
#pragma once

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/experiments/existence/protocol.hpp"

namespace understory::eval::experiments::existence {

/// What all parts share.
struct ExistenceRun {
  int runs = 20;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::filesystem::path data;
  const std::atomic<bool>& stop;
  std::vector<TunedMethod> methods;
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json traces = nlohmann::json::object();
};

/// Histories on which everything was tuned: seeds 100001 and 100002, three shares of change.
std::vector<History> training_histories();

/// ROC area, precision, Brier, wrongly removed for shares changed of 5 to 50 %.
void run_worlds(ExistenceRun& run);
/// An hour beside a van; a clear-cut beside a lorry; with ranges and without.
void run_traps(ExistenceRun& run);
/// "Seen means exists", questioned by false sightings; new points of which some are false.
void run_false_sightings(ExistenceRun& run);
/// Big Woods at two dates against Bayes' filter with the true rates; the control without change;
/// mortality of BCI's trees.
void run_forest(ExistenceRun& run);
/// One shell as it learns, for the plot.
void trace_shell(ExistenceRun& run);

/// A number of a row, for the table on screen.
std::string shown(const nlohmann::json& row, const char* key, int digits = 3);

}  // namespace understory::eval::experiments::existence
