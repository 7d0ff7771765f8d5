#include "eval/experiments/backend/backend_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::backend {
namespace {

/// GTSAM's ISAM2 (0ffe6c93, Release, one thread), one pose per update, fast setting; measured once
/// on one core of an AMD EPYC that was busy with other work. Its chi^2 counts by other conventions,
/// and where `optimum` is not ours its file or its weights were others.
struct Reference {
  const char* dataset;
  double total_s, ms_p50, ms_p99, ms_max;
  double optimum;             ///< Its own; 0: unknown.
  double refactorisation_ms;  ///< CHOLMOD there, of its last graph; 0: unknown.
};
constexpr Reference kReferences[] = {
    {"g2o_manhattanOlson3500", 3.09, 0.14, 8.1, 50.0, 137.93, 5.0},
    {"isam_manhattanOlson3500", 3.09, 0.14, 8.1, 50.0, 137.93, 5.0},
    {"victoriaPark_isam", 17.4, 0.38, 30.0, 133.0, 4678.44, 4.5},
    {"isam_cityTrees10000", 17.1, 0.42, 15.3, 37.0, 8668.9, 0.0},
    {"sesync_city10000", 67.6, 3.2, 29.0, 107.0, 512.00, 50.0},
    {"parking-garage", 2.43, 0.37, 21.0, 61.0, 1.2684, 0.0},
    {"sphere2500", 34.3, 12.4, 36.0, 46.0, 1351.49, 62.0},
    {"torus3D", 109.0, 15.4, 111.0, 277.0, 0.0, 470.0},
};

/// Optima stored beside the graphs (pose_graphs/README.txt, Levenberg-Marquardt of another program
/// to convergence; Victoria Park: a batch solver in the convention of the square-root file).
struct KnownOptimum {
  const char* dataset;
  double chi2;
};
constexpr KnownOptimum kKnownOptima[] = {
    {"w100", 1.13783},
    {"g2o_manhattanOlson3500", 146.0766},
    {"isam_manhattanOlson3500", 6532.745},
    {"sesync_city10000", 511.985},
    {"isam_cityTrees10000", 8668.93},
    {"g2o_intel", 546.461},
    {"sesync_CSAIL", 40.5551},
    {"tinyGrid3D", 6.72788},
    {"smallGrid3D", 458.154},
    {"parking-garage", 1.23885},
    {"sphere2500", 727.150},
    {"torus3D", 14574.75},
    {"victoriaPark_isam", 6184.12},
};

/// Below it nothing but rounding is left of measurements that agree.
constexpr double kLeastLoss = 1e-6;

nlohmann::json summary_of(const std::vector<Moment>& moments) {
  std::vector<double> excess;
  std::vector<double> sigma;
  std::vector<double> newest_m;
  int unverified = 0;
  for (const Moment& moment : moments) {
    unverified += moment.is_verified ? 0 : 1;
    if (moment.chi2_batch > kLeastLoss) excess.push_back(moment.chi2 / moment.chi2_batch - 1.0);
    newest_m.push_back(moment.newest.m);
    sigma.push_back(moment.newest.sigma);
    sigma.insert(sigma.end(), moment.seen_sigma.begin(), moment.seen_sigma.end());
  }
  return {{"count", moments.size()},
          {"unverified", unverified},
          {"excess_p50", tools::quantile(excess, 0.5)},
          {"excess_max", tools::quantile(excess, 1.0)},
          {"sigma_p50", tools::quantile(sigma, 0.5)},
          {"sigma_p99", tools::quantile(sigma, 0.99)},
          {"newest_m_max", tools::quantile(newest_m, 1.0)}};
}

std::string cell(const nlohmann::json& from, const char* key, const char* form = "{:.2f}",
                 double scale = 1.0) {
  if (!from.contains(key) || !from[key].is_number()) return "-";
  return fmt::format(fmt::runtime(form), scale * from[key].get<double>());
}

}  // namespace

nlohmann::json row_of(const BackendRun& run) {
  double total_ms = 0.0;
  for (const double ms : run.update_ms) total_ms += ms;
  const double largest_ms = tools::quantile(run.update_ms, 1.0);

  nlohmann::json row{{"dataset", run.dataset},
                     {"method", "smoothing"},
                     {"poses", run.poses},
                     {"points", run.points},
                     {"factors", run.factors},
                     {"total_s", 1e-3 * total_ms},
                     {"settle_s", 1e-3 * run.settle_ms},
                     {"ms_p50", tools::quantile(run.update_ms, 0.5)},
                     {"ms_p99", tools::quantile(run.update_ms, 0.99)},
                     {"ms_max", largest_ms},
                     {"ms_max_with_settle", std::max(largest_ms, run.settle_ms)},
                     {"whole_ms", run.whole_ms},
                     {"refactorisation_ms", run.refactorisation_ms},
                     {"moments", summary_of(run.moments)},
                     {"chi2_final", run.chi2_final},
                     {"chi2_batch", run.chi2_batch},
                     {"chi2_odometry", run.chi2_odometry},
                     {"rss_mb", run.rss_mb},
                     {"error", run.error}};
  if (run.chi2_chordal) row["chi2_chordal"] = *run.chi2_chordal;

  for (const KnownOptimum& known : kKnownOptima) {
    if (run.dataset == known.dataset) row["chi2_known"] = known.chi2;
  }
  for (const Reference& reference : kReferences) {
    if (run.dataset != reference.dataset) continue;
    row["reference"] = {{"total_s", reference.total_s},
                        {"ms_p50", reference.ms_p50},
                        {"ms_p99", reference.ms_p99},
                        {"ms_max", reference.ms_max}};
    if (reference.optimum > 0.0) row["reference"]["optimum"] = reference.optimum;
    if (reference.refactorisation_ms > 0.0) {
      row["reference"]["refactorisation_ms"] = reference.refactorisation_ms;
    }
  }
  return row;
}

nlohmann::json trace_of(const BackendRun& run) {
  return {{"dataset", run.dataset}, {"update_ms", run.update_ms}};
}

void print_heading() {
  fmt::print("{:<24}{:>6}{:>7} |{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8} |{:>8}{:>8}{:>8} ", "data",
             "poses", "edges", "total s", "p50 ms", "p99 ms", "max ms", "settle", "whole",
             "CHOLMOD", "ISAM2 s", "p99 ms", "max ms");
  fmt::print("|{:>9}{:>9}{:>9}{:>9}{:>10} ", "exc50 %", "excmax %", "sig p50", "sig p99",
             "newest m");
  fmt::print("|{:>12}{:>10}{:>12}{:>12}{:>12}{:>12}{:>8}\n", "chi2", "excess", "batch", "odometry",
             "chordal", "stored", "RSS MB");
}

void print_row(const nlohmann::json& row) {
  const nlohmann::json reference = row.value("reference", nlohmann::json::object());
  const nlohmann::json& moments = row["moments"];
  const double final = row["chi2_final"].get<double>();
  const double batch = row["chi2_batch"].get<double>();
  // Of measurements that agree exactly nothing is left but rounding.
  const bool has_residual = batch > kLeastLoss && std::isfinite(final / batch);
  const std::string excess =
      has_residual ? fmt::format("{:.4f}%", 100.0 * (final / batch - 1.0)) : "-";

  fmt::print("{:<24}{:>6}{:>7} |{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8} |{:>8}{:>8}{:>8} ",
             row["dataset"].get<std::string>(), row["poses"].get<int>(), row["factors"].get<int>(),
             cell(row, "total_s"), cell(row, "ms_p50", "{:.3f}"), cell(row, "ms_p99"),
             cell(row, "ms_max"), cell(row, "settle_s", "{:.1f}", 1e3), cell(row, "whole_ms"),
             cell(row, "refactorisation_ms"), cell(reference, "total_s"), cell(reference, "ms_p99"),
             cell(reference, "ms_max"));
  fmt::print("|{:>9}{:>9}{:>9}{:>9}{:>10} ", cell(moments, "excess_p50", "{:.4f}", 100.0),
             cell(moments, "excess_max", "{:.4f}", 100.0), cell(moments, "sigma_p50", "{:.4f}"),
             cell(moments, "sigma_p99", "{:.4f}"), cell(moments, "newest_m_max", "{:.5f}"));
  fmt::print("|{:>12}{:>10}{:>12}{:>12}{:>12}{:>12}{:>8} {}\n", cell(row, "chi2_final", "{:.5g}"),
             excess, cell(row, "chi2_batch", "{:.7g}"), cell(row, "chi2_odometry", "{:.7g}"),
             cell(row, "chi2_chordal", "{:.7g}"), cell(row, "chi2_known", "{:.7g}"),
             cell(row, "rss_mb", "{:.0f}"), row["error"].get<std::string>());
}

}  // namespace understory::eval::experiments::backend
