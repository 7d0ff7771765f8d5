// Rows of the partition experiments: means over the runs, with their 95 % confidence intervals.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "eval/experiments/partition/scoring.hpp"

namespace understory::eval::experiments::partition {

/// The outcomes of one run on one route with one front end.
struct RouteRun {
  std::string route;
  std::string front_end;  ///< "ideal" or "lidar".
  int run = 0;
  std::vector<Outcome> outcomes;
};

/// A row for each route, front end, policy and method. `is_closed` says which of the thesis's
/// tables are beside them.
nlohmann::json rows_of(const std::vector<RouteRun>& runs, bool is_closed);
/// What a cut does to the motion across it, by method, size of the submaps and number of landmarks
/// at the cut; intervals over the runs.
nlohmann::json effects_of(const std::vector<RouteRun>& runs);
/// Trajectories with their cuts of run 0, for the plots.
nlohmann::json traces_of(const std::vector<RouteRun>& runs);
/// The rows for the screen.
std::string table_of(const nlohmann::json& rows);

}  // namespace understory::eval::experiments::partition
