#include "eval/harness/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

namespace understory::eval::harness {
namespace {

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Averages over the runs for each keyframe, then looks how many keyframes lie in the band.
void summarise_nees(const std::vector<RunResult>& runs, Summary& summary) {
  std::map<std::size_t, std::pair<double, double>> sum_and_count;
  for (const RunResult& run : runs) {
    for (const auto& [keyframe, nees] : run.score.nees) {
      sum_and_count[keyframe].first += nees;
      sum_and_count[keyframe].second += 1.0;
    }
  }

  double sum = 0.0;
  double count = 0.0;
  std::size_t in_band = 0;
  for (const auto& [keyframe, entry] : sum_and_count) {
    sum += entry.first;
    count += entry.second;
    const auto [low, high] = chi2_band_95(3.0 * entry.second);
    if (entry.first >= low && entry.first <= high) ++in_band;
  }

  if (count > 0.0) summary.nees = sum / count;
  summary.nees_in_band_pct = percent(in_band, sum_and_count.size());
}

Summary summary_of(const Cell& cell, const std::string& method,
                   const std::vector<RunResult>& runs) {
  Summary summary;
  summary.cell = cell;
  summary.method = method;
  summary.has_ideal_scans = method != kLidarMethod && method != kLidarFilter;
  summary.has_map = method != kLidarFilter;
  summary.runs = static_cast<int>(runs.size());

  std::vector<double> roe_deg;
  std::vector<double> ate_cm;
  metrics::MapCompleteness total;
  for (const RunResult& run : runs) {
    const RunScore& score = run.score;
    summary.rpe_cm_runs.push_back(100.0 * score.errors.rpe_m());
    summary.lpe_cm_runs.push_back(100.0 * score.errors.lpe_m());
    roe_deg.push_back(180.0 / std::numbers::pi * score.errors.roe_rad());
    ate_cm.push_back(100.0 * score.ate_m);

    summary.updates += score.updates / static_cast<double>(runs.size());
    summary.updates_possible = score.updates_possible;
    summary.wrong_updates += score.wrong_updates;
    summary.runs_with_new_maps += score.new_maps > 0 ? 1 : 0;

    total.well_seen += score.completeness.well_seen;
    total.recalled += score.completeness.recalled;
    total.landmarks += score.completeness.landmarks;
    total.without_trunk += score.completeness.without_trunk;
    summary.landmarks_in_range +=
        static_cast<double>(score.landmarks_in_range) / static_cast<double>(runs.size());
  }

  summary.rpe_cm = statistics_of(summary.rpe_cm_runs);
  summary.lpe_cm = statistics_of(summary.lpe_cm_runs);
  summary.roe_deg = statistics_of(roe_deg);
  summary.ate_cm = statistics_of(ate_cm);
  summary.map_recall_pct = percent(total.recalled, total.well_seen);
  summary.false_landmarks_pct = percent(total.without_trunk, total.landmarks);
  summarise_nees(runs, summary);
  return summary;
}

/// A perfect oracle (no noise) has no ratio.
double ratio(double value, double oracle) { return oracle > 1e-6 ? value / oracle : 0.0; }

}  // namespace

Statistics statistics_of(const std::vector<double>& values) {
  Statistics result;
  if (values.empty()) return result;
  const auto n = static_cast<double>(values.size());
  result.mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  if (values.size() < 2) return result;
  double squares = 0.0;
  for (const double value : values) squares += (value - result.mean) * (value - result.mean);
  result.standard_deviation = std::sqrt(squares / (n - 1.0));
  return result;
}

std::pair<double, double> chi2_band_95(double dof) {
  const boost::math::chi_squared distribution(dof);
  return {quantile(distribution, 0.025), quantile(distribution, 0.975)};
}

std::vector<Summary> summarise(const std::vector<CellResult>& cells,
                               const std::vector<std::string>& methods) {
  std::vector<Summary> rows;
  for (const CellResult& cell : cells) {
    const std::size_t first = rows.size();
    for (const std::string& method : methods) {
      rows.push_back(summary_of(cell.cell, method, cell.runs.at(method)));
    }
    const auto oracle = std::find_if(rows.begin() + static_cast<std::ptrdiff_t>(first), rows.end(),
                                     [](const Summary& row) { return row.method == "oracle"; });
    if (oracle == rows.end()) continue;
    for (std::size_t i = first; i < rows.size(); ++i) {
      if (!rows[i].has_ideal_scans) continue;
      rows[i].ratio = ratio(rows[i].rpe_cm.mean, oracle->rpe_cm.mean);
      rows[i].ratio_lpe = ratio(rows[i].lpe_cm.mean, oracle->lpe_cm.mean);
    }
  }
  return rows;
}

nlohmann::json to_json(const Summary& row) {
  const auto rounded = [](double value) { return std::round(1e6 * value) / 1e6; };
  nlohmann::json json{{"method", row.method},
                      {"path", sim::to_string(row.cell.path)},
                      {"forest", sim::to_string(row.cell.forest)},
                      {"sigma_cm", rounded(100.0 * row.cell.sigma_m)},
                      {"detection_pct", rounded(100.0 * row.cell.detection)},
                      {"interval_cm", rounded(100.0 * row.cell.interval_m)},
                      {"errors", to_string(row.cell.errors)},
                      {"runs", row.runs},
                      {"rpe_cm", row.rpe_cm.mean},
                      {"rpe_cm_sd", row.rpe_cm.standard_deviation},
                      {"rpe_cm_runs", row.rpe_cm_runs},
                      {"lpe_cm", row.lpe_cm.mean},
                      {"lpe_cm_sd", row.lpe_cm.standard_deviation},
                      {"lpe_cm_runs", row.lpe_cm_runs},
                      {"roe_deg", row.roe_deg.mean},
                      {"ate_cm", row.ate_cm.mean},
                      {"updates", row.updates},
                      {"updates_possible", row.updates_possible},
                      {"wrong_updates", row.wrong_updates},
                      {"runs_with_new_maps", row.runs_with_new_maps},
                      {"map_recall_pct", row.map_recall_pct},
                      {"false_landmarks_pct", row.false_landmarks_pct},
                      {"landmarks_in_range", row.landmarks_in_range}};

  // Null where there is nothing to compare with, so that no script takes it for a number.
  const auto or_null = [](double value) {
    return value > 0.0 ? nlohmann::json(value) : nlohmann::json(nullptr);
  };

  json["ratio"] = or_null(row.ratio);
  json["ratio_lpe"] = or_null(row.ratio_lpe);
  json["nees"] = or_null(row.nees);
  if (!row.has_ideal_scans) json["sigma_cm"] = json["detection_pct"] = json["errors"] = nullptr;
  if (!row.has_map) {
    for (const char* key :
         {"lpe_cm", "lpe_cm_sd", "lpe_cm_runs", "map_recall_pct", "false_landmarks_pct",
          "landmarks_in_range", "updates", "updates_possible"}) {
      json[key] = nullptr;
    }
  }

  json["nees_in_band_pct"] = row.nees > 0.0 ? nlohmann::json(row.nees_in_band_pct) : nullptr;
  if (row.cell.published) {
    json["published_rpe_cm"] = row.cell.published->rpe_cm;
    json["published_lpe_cm"] = row.cell.published->lpe_cm;
    if (row.cell.published->updates) json["published_updates"] = *row.cell.published->updates;
  }
  return json;
}

std::string to_table(const std::vector<Summary>& rows) {
  std::string table = fmt::format(
      "{:<14} {:<12} {:>5} {:>4} {:>4} {:<11} {:<9} {:>8} {:>6} {:>8} {:>6} {:>6} {:>11} {:>5} "
      "{:>7} {:>6} {:>7} {:>5} | {:>7} {:>7} {:>6}\n",
      "path", "forest", "noise", "det", "step", "errors", "method", "RPE cm", "+-sd", "LPE cm",
      "ratio", "r.LPE", "updates", "wrong", "recall", "false", "ATE cm", "NEES", "RPE", "LPE",
      "upd.");

  for (const Summary& row : rows) {
    const auto number = [](double value, const char* format) {
      return value > 0.0 ? fmt::format(fmt::runtime(format), value) : std::string("-");
    };
    const auto if_any = [](bool any, double value, const char* format) {
      return any ? fmt::format(fmt::runtime(format), value) : std::string("-");
    };

    table += fmt::format(
        "{:<14} {:<12} {:>5} {:>4} {:>2.0f}cm {:<11} {:<9} {:>8.2f} {:>6.2f} {:>8} {:>6} {:>6} "
        "{:>11} {:>5} {:>7} {:>6} {:>7.2f} {:>5} |",
        sim::to_string(row.cell.path), sim::to_string(row.cell.forest),
        if_any(row.has_ideal_scans, 100.0 * row.cell.sigma_m, "{:.0f}cm"),
        if_any(row.has_ideal_scans, 100.0 * row.cell.detection, "{:.0f}%"),
        100.0 * row.cell.interval_m, to_string(row.cell.errors), row.method, row.rpe_cm.mean,
        row.rpe_cm.standard_deviation, if_any(row.has_map, row.lpe_cm.mean, "{:.2f}"),
        number(row.ratio, "{:.3f}"), number(row.ratio_lpe, "{:.3f}"),
        row.has_map ? fmt::format("{:>7.1f}/{:<3}", row.updates, row.updates_possible) : "-",
        row.wrong_updates, if_any(row.has_map, row.map_recall_pct, "{:.1f}%"),
        if_any(row.has_map, row.false_landmarks_pct, "{:.2f}%"), row.ate_cm.mean,
        number(row.nees, "{:.2f}"));

    if (row.cell.published) {
      table += fmt::format(" {:>7.2f} {:>7.2f} {:>6}", row.cell.published->rpe_cm,
                           row.cell.published->lpe_cm,
                           number(row.cell.published->updates.value_or(0.0), "{:.1f}"));
    }
    table += '\n';
  }
  return table;
}

}  // namespace understory::eval::harness
