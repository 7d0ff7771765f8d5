#include "eval/experiments/partition/partition_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "eval/harness/summary.hpp"

namespace understory::eval::experiments::partition {
namespace {

using nlohmann::json;

/// Where the thesis's thresholds lie, and more of it.
constexpr double kLandmarkBounds[] = {0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0, 1e9};

/// Half width of the 95 % interval of a mean; 0 for fewer than two values.
double half_width_95(const std::vector<double>& values) {
  if (values.size() < 2) return 0.0;
  const auto n = static_cast<double>(values.size());
  const boost::math::students_t distribution(n - 1.0);
  return boost::math::quantile(distribution, 0.975) *
         harness::statistics_of(values).standard_deviation / std::sqrt(n);
}

void put_mean(json& row, const std::string& key, const std::vector<double>& values) {
  row[key] = harness::statistics_of(values).mean;
  row[key + "_ci95"] = half_width_95(values);
}

/// Outcomes of one method with one policy.
struct PartitionCell {
  std::string route;
  std::string front_end;
  std::string method;
  Policy policy;
  std::vector<const Outcome*> outcomes;
  int failures = 0;
  std::string failure;
};

using CellKey = std::tuple<std::string, std::string, std::string, double, double, std::string>;

std::vector<PartitionCell> cells_of(const std::vector<RouteRun>& runs) {
  std::vector<PartitionCell> cells;
  std::map<CellKey, std::size_t> numbers;
  for (const RouteRun& run : runs) {
    for (const Outcome& outcome : run.outcomes) {
      const CellKey key{run.route,
                        run.front_end,
                        outcome.policy.name,
                        outcome.policy.size_m,
                        outcome.policy.threshold,
                        outcome.method};
      const auto [entry, is_new] = numbers.try_emplace(key, cells.size());
      if (is_new)
        cells.push_back({run.route, run.front_end, outcome.method, outcome.policy, {}, 0, {}});
      PartitionCell& cell = cells[entry->second];
      if (outcome.failure.empty()) {
        cell.outcomes.push_back(&outcome);
      } else {
        ++cell.failures;
        cell.failure = outcome.failure;
      }
    }
  }
  return cells;
}

template <class F>
std::vector<double> values_of(const PartitionCell& cell, F value) {
  std::vector<double> values;
  values.reserve(cell.outcomes.size());
  for (const Outcome* outcome : cell.outcomes) values.push_back(value(*outcome));
  return values;
}

double ratio_of(double value, double other) { return other > 0.0 ? value / other : 1.0; }

void put_distances(const PartitionCell& cell, json& row) {
  const auto put_all = [&](const std::string& end, Distances Outcome::*member) {
    put_mean(row, "rmse_to_" + end,
             values_of(cell, [&](const Outcome& o) { return (o.*member).all_m; }));
    put_mean(row, "rmse_at_cuts_to_" + end,
             values_of(cell, [&](const Outcome& o) { return (o.*member).at_cuts_m; }));
    put_mean(row, "rmse_between_to_" + end,
             values_of(cell, [&](const Outcome& o) { return (o.*member).between_m; }));
  };
  put_all("uncut_m", &Outcome::to_uncut);
  put_all("reference_m", &Outcome::to_reference);
  put_mean(row, "uncut_rmse_to_reference_m",
           values_of(cell, [](const Outcome& o) { return o.uncut_to_reference.all_m; }));
  put_mean(row, "at_cuts_of_uncut", values_of(cell, [](const Outcome& o) {
             return ratio_of(o.to_reference.at_cuts_m, o.uncut_to_reference.at_cuts_m);
           }));
  put_mean(row, "between_of_uncut", values_of(cell, [](const Outcome& o) {
             return ratio_of(o.to_reference.between_m, o.uncut_to_reference.between_m);
           }));
  const auto to_uncut = values_of(cell, [](const Outcome& o) { return o.to_uncut.all_m; });
  row["worst_rmse_to_uncut_m"] =
      to_uncut.empty() ? 0.0 : *std::max_element(to_uncut.begin(), to_uncut.end());
}

void put_costs(const PartitionCell& cell, json& row) {
  put_mean(row, "mean_submap_m", values_of(cell, [](const Outcome& o) {
             return o.length_m / static_cast<double>(o.submaps);
           }));
  put_mean(row, "submaps",
           values_of(cell, [](const Outcome& o) { return static_cast<double>(o.submaps); }));
  put_mean(row, "partition_ms", values_of(cell, [](const Outcome& o) { return o.partition_ms; }));
  put_mean(row, "iteration_ms", values_of(cell, [](const Outcome& o) { return o.iteration_ms; }));
  put_mean(row, "closure_s", values_of(cell, [](const Outcome& o) { return o.closure_s; }));
  put_mean(row, "rss_mb", values_of(cell, [](const Outcome& o) { return o.resident_mb; }));
  put_mean(row, "disk_mb_per_km", values_of(cell, [](const Outcome& o) {
             return 1e-6 * o.stored_bytes / (1e-3 * o.length_m);
           }));
  put_mean(row, "mean_nees", values_of(cell, [](const Outcome& o) { return o.mean_nees; }));
  std::size_t refused = 0;
  for (const Outcome* outcome : cell.outcomes) refused += outcome->refused;
  row["refused"] = refused;
}

void put_published(const PartitionCell& cell, bool is_closed, json& row) {
  if (cell.method != "baseline" && cell.method != "smoothing") return;
  const auto thesis = published(cell.route, cell.policy, is_closed);
  if (!thesis) return;
  row["thesis_rmse_m"] = thesis->rmse_m;
  if (thesis->partition_ms) row["thesis_partition_ms"] = *thesis->partition_ms;
  if (thesis->iteration_ms) row["thesis_iteration_ms"] = *thesis->iteration_ms;
  if (thesis->mean_submap_m) row["thesis_mean_submap_m"] = *thesis->mean_submap_m;
}

/// Sums of the effects of one run's cuts.
struct EffectSums {
  double cuts = 0.0;
  double landmarks = 0.0;
  double step_m = 0.0;
  double step_mrad = 0.0;
};

using EffectKey = std::tuple<std::string, std::string, double, std::size_t>;

/// By front end, method, size and class of landmarks: the sums of each drive.
std::map<EffectKey, std::vector<EffectSums>> effect_sums(const std::vector<RouteRun>& runs) {
  std::map<EffectKey, std::vector<EffectSums>> sums;
  for (const RouteRun& run : runs) {
    std::map<EffectKey, EffectSums> own;
    for (const Outcome& outcome : run.outcomes) {
      for (const CutEffect& effect : outcome.effects) {
        const auto* above = std::upper_bound(std::begin(kLandmarkBounds), std::end(kLandmarkBounds),
                                             effect.landmarks);
        const auto bin = static_cast<std::size_t>(above - std::begin(kLandmarkBounds)) - 1;
        EffectSums& one = own[{run.front_end, outcome.method, outcome.policy.size_m, bin}];
        one.cuts += 1.0;
        one.landmarks += effect.landmarks;
        one.step_m += effect.step_m;
        one.step_mrad += effect.step_mrad;
      }
    }
    for (const auto& [key, one] : own) sums[key].push_back(one);
  }
  return sums;
}

std::string with_interval(const json& row, const std::string& key, double factor) {
  const double value = factor * row.at(key).get<double>();
  const double half = factor * row.at(key + "_ci95").get<double>();
  return fmt::format("{:.2f} +-{:.2f}", value, half);
}

}  // namespace

json rows_of(const std::vector<RouteRun>& runs, bool is_closed) {
  json rows = json::array();
  for (const PartitionCell& cell : cells_of(runs)) {
    json row{{"route", cell.route},
             {"front_end", cell.front_end},
             {"method", cell.method},
             {"policy", cell.policy.name},
             {"label", cell.policy.label()},
             {"size_m", cell.policy.size_m},
             {"threshold", cell.policy.threshold},
             {"is_closed", is_closed},
             {"runs", cell.outcomes.size()},
             {"failed", cell.failures}};
    if (cell.failures > 0) row["failure"] = cell.failure;
    put_distances(cell, row);
    put_costs(cell, row);
    put_published(cell, is_closed, row);
    rows.push_back(std::move(row));
  }
  return rows;
}

json effects_of(const std::vector<RouteRun>& runs) {
  json rows = json::array();
  for (const auto& [key, sums] : effect_sums(runs)) {
    const auto& [front_end, method, size_m, bin] = key;
    double cuts = 0.0;
    std::vector<double> landmarks;
    std::vector<double> step_m;
    std::vector<double> step_mrad;
    for (const EffectSums& one : sums) {
      cuts += one.cuts;
      landmarks.push_back(one.landmarks / one.cuts);
      step_m.push_back(one.step_m / one.cuts);
      step_mrad.push_back(one.step_mrad / one.cuts);
    }
    json row{{"front_end", front_end},
             {"method", method},
             {"size_m", size_m},
             {"landmarks_from", kLandmarkBounds[bin]},
             {"landmarks_below", kLandmarkBounds[bin + 1]},
             {"drives", sums.size()},
             {"cuts", cuts}};
    put_mean(row, "landmarks", landmarks);
    put_mean(row, "step_m", step_m);
    put_mean(row, "step_mrad", step_mrad);
    rows.push_back(std::move(row));
  }
  return rows;
}

json traces_of(const std::vector<RouteRun>& runs) {
  json traces = json::array();
  for (const RouteRun& run : runs) {
    if (run.run != 0) continue;
    for (const Outcome& outcome : run.outcomes) {
      json poses = json::array();
      for (const metrics::StampedPose& one : outcome.trajectory)
        poses.push_back({1e-6 * static_cast<double>(one.utime), one.pose.x(), one.pose.y()});
      json cuts = json::array();
      for (const model::Utime cut : outcome.cuts) cuts.push_back(1e-6 * static_cast<double>(cut));
      traces.push_back({{"route", run.route},
                        {"front_end", run.front_end},
                        {"method", outcome.method},
                        {"label", outcome.policy.label()},
                        {"poses", std::move(poses)},
                        {"cuts_s", std::move(cuts)}});
    }
  }
  return traces;
}

std::string table_of(const json& rows) {
  std::string out = fmt::format(
      "{:<18} {:<6} {:<15} {:<20} {:>7} {:>15} {:>15} {:>15} {:>9} {:>9} "
      "{:>9}\n",
      "route", "from", "policy", "method", "submaps", "to uncut cm", "to truth cm", "at cuts cm",
      "cut ms", "step ms", "thesis m");
  for (const json& row : rows) {
    if (row.at("runs") == 0) {
      out += fmt::format("{:<18} {:<6} {:<15} {:<20} {}\n", row.at("route").get<std::string>(),
                         row.at("front_end").get<std::string>(), row.at("label").get<std::string>(),
                         row.at("method").get<std::string>(), row.at("failure").get<std::string>());
      continue;
    }
    const std::string thesis = row.contains("thesis_rmse_m")
                                   ? fmt::format("{:.4f}", row.at("thesis_rmse_m").get<double>())
                                   : "";
    out += fmt::format(
        "{:<18} {:<6} {:<15} {:<20} {:>7.1f} {:>15} {:>15} {:>15} {:>9.2f} {:>9.3f} {:>9}\n",
        row.at("route").get<std::string>(), row.at("front_end").get<std::string>(),
        row.at("label").get<std::string>(), row.at("method").get<std::string>(),
        row.at("submaps").get<double>(), with_interval(row, "rmse_to_uncut_m", 100.0),
        with_interval(row, "rmse_to_reference_m", 100.0),
        with_interval(row, "rmse_at_cuts_to_reference_m", 100.0),
        row.at("partition_ms").get<double>(), row.at("iteration_ms").get<double>(), thesis);
  }
  return out;
}

}  // namespace understory::eval::experiments::partition
