// eval backend: the smoother on standard graphs, beside the field's reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/io/output_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "eval/experiments/backend/backend.hpp"
#include "eval/experiments/backend/backend_world.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::backend {
namespace {

/// GTSAM's ISAM2 (0ffe6c93, Release, one thread), one pose per update, fast setting; measured once
/// on one core of an AMD EPYC that was busy with other work. Its chi^2 counts by other conventions.
struct Reference {
  const char* dataset;
  double total_s, ms_p50, ms_p99, ms_max;
};
constexpr Reference kReferences[] = {
    {"g2o_manhattanOlson3500", 3.09, 0.14, 8.1, 50.0},
    {"isam_manhattanOlson3500", 3.09, 0.14, 8.1, 50.0},
    {"victoriaPark_isam", 17.4, 0.38, 30.0, 133.0},
    {"isam_cityTrees10000", 17.1, 0.42, 15.3, 37.0},
    {"sesync_city10000", 67.6, 3.2, 29.0, 107.0},
    {"parking-garage", 2.43, 0.37, 21.0, 61.0},
    {"sphere2500", 34.3, 12.4, 36.0, 46.0},
    {"torus3D", 109.0, 15.4, 111.0, 277.0},
};

struct BackendOptions {
  std::vector<std::string> files;
  int world_poses = 0;
  std::uint64_t seed = 1;
  std::string json;
  bool plots = true;
};

nlohmann::json row_of(const BackendRun& run) {
  double total_ms = run.settle_ms;
  for (const double ms : run.update_ms) total_ms += ms;

  nlohmann::json row{{"dataset", run.dataset},
                     {"method", "smoothing"},
                     {"poses", run.poses},
                     {"points", run.points},
                     {"factors", run.factors},
                     {"total_s", 1e-3 * total_ms},
                     {"settle_s", 1e-3 * run.settle_ms},
                     {"ms_p50", tools::quantile(run.update_ms, 0.5)},
                     {"ms_p99", tools::quantile(run.update_ms, 0.99)},
                     {"ms_max", tools::quantile(run.update_ms, 1.0)},
                     {"whole_ms", run.whole_ms},
                     {"chi2_final", run.chi2_final},
                     {"chi2_batch", run.chi2_batch},
                     {"batch_s", run.batch_s},
                     {"chi2_dead_reckoning", run.chi2_dead_reckoning},
                     {"rss_mb", run.rss_mb},
                     {"smoother_mb", run.smoother_mb},
                     {"error", run.error}};

  for (const Reference& reference : kReferences) {
    if (run.dataset != reference.dataset) continue;
    row["reference"] = {{"total_s", reference.total_s},
                        {"ms_p50", reference.ms_p50},
                        {"ms_p99", reference.ms_p99},
                        {"ms_max", reference.ms_max}};
  }
  return row;
}

void print_heading() {
  fmt::print(
      "{:<26}{:>7}{:>8} |{:>9}{:>8}{:>9}{:>9}{:>9} |{:>9}{:>8}{:>8} "
      "|{:>13}{:>13}{:>10}{:>15}{:>8}\n",
      "data", "poses", "factors", "total s", "p50 ms", "p99 ms", "max ms", "whole ms", "ISAM2 s",
      "p99 ms", "max ms", "chi2", "chi2 batch", "excess", "from odometry", "RSS MB");
}

void print_row(const nlohmann::json& row) {
  const auto number = [](const nlohmann::json& from, const char* key) {
    return from.contains(key) ? fmt::format("{:.2f}", from[key].get<double>()) : std::string("-");
  };
  const nlohmann::json reference = row.value("reference", nlohmann::json::object());
  const double final = row["chi2_final"].get<double>();
  const double batch = row["chi2_batch"].get<double>();
  // Of measurements that agree exactly nothing is left but rounding.
  const bool has_residual = batch > 1e-9 && std::isfinite(final / batch);
  const std::string excess =
      has_residual ? fmt::format("{:.4f}%", 100.0 * (final / batch - 1.0)) : "-";

  fmt::print(
      "{:<26}{:>7}{:>8} |{:>9.2f}{:>8.3f}{:>9.2f}{:>9.2f}{:>9.2f} |{:>9}{:>8}{:>8} "
      "|{:>13.5f}{:>13.5f}"
      "{:>10}{:>15.6g}{:>8.0f} {}\n",
      row["dataset"].get<std::string>(), row["poses"].get<int>(), row["factors"].get<int>(),
      row["total_s"].get<double>(), row["ms_p50"].get<double>(), row["ms_p99"].get<double>(),
      row["ms_max"].get<double>(), row["whole_ms"].get<double>(), number(reference, "total_s"),
      number(reference, "ms_p99"), number(reference, "ms_max"), final, batch, excess,
      row["chi2_dead_reckoning"].get<double>(), row["rss_mb"].get<double>(),
      row["error"].get<std::string>());
}

/// Two street grids: with odometry that drifts, and with odometry far better than the closures.
std::vector<std::pair<std::string, WorldParameters>> worlds(int poses) {
  if (poses == 0) return {};
  WorldParameters drifting;
  drifting.poses = poses;
  WorldParameters precise = drifting;
  precise.motion_m = precise.motion_rad = 0.002;
  precise.closure_m = precise.closure_rad = 0.1;
  return {{fmt::format("streets-{}-drifting", poses), drifting},
          {fmt::format("streets-{}-precise", poses), precise}};
}

/// None where the file is refused, which is said: the others go on.
std::optional<BackendRun> run_file(const std::string& file) {
  try {
    return run_backend(file);
  } catch (const std::exception& error) {
    fmt::print(stderr, "backend: {}\n", terminal::printable(error.what()));
    return std::nullopt;
  }
}

void write_results(const BackendOptions& options, const nlohmann::json& rows,
                   const nlohmann::json& traces) {
  const std::filesystem::path out = options.json;
  harness::write_json(harness::traces_file(out), traces);

  std::vector<std::string> names;  // names alone: folders are those of one machine
  for (const std::string& file : options.files) {
    names.push_back(std::filesystem::path(file).filename().string());
  }

  harness::write_json(
      out, harness::result_document(
               "backend",
               {{"files", names}, {"streets", options.world_poses}, {"seed", options.seed}}, rows));
  if (options.plots) harness::plot("backend.py", {out, harness::traces_file(out).string()});
}

void run_experiment(const BackendOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json traces = nlohmann::json::array();

  const auto keep = [&](const BackendRun& run) {
    rows.push_back(row_of(run));
    print_row(rows.back());
    traces.push_back({{"dataset", run.dataset}, {"update_ms", run.update_ms}});
    if (stop) throw terminal::Interrupted{};
  };

  if (options.files.empty() && options.world_poses == 0) {
    throw std::invalid_argument("backend: neither --data nor --streets is given");
  }

  for (const std::string& file : options.files) {
    if (options.json.empty() || !io::is_same_file(file, options.json)) continue;
    throw std::invalid_argument("backend: --json " + options.json + " is one of the graphs");
  }

  print_heading();
  std::size_t refused = 0;
  for (const std::string& file : options.files) {
    if (const auto run = run_file(file)) {
      keep(*run);
    } else {
      ++refused;
    }
  }
  for (const auto& [name, parameters] : worlds(options.world_poses)) {
    keep(run_backend(make_world(parameters, options.seed), name));
  }

  if (!options.json.empty()) write_results(options, rows, traces);
  if (refused > 0) {
    throw std::runtime_error(fmt::format("{} of {} files refused", refused, options.files.size()));
  }
}

}  // namespace

void add_backend_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "backend", "The smoother on standard graphs, one pose per update (g2o, TORO, iSAM text)");
  const auto options = std::make_shared<BackendOptions>();
  command.add_option("--data", options->files, "Graph files")->check(CLI::ExistingFile);
  command
      .add_option("--streets", options->world_poses,
                  "Simulated street grids of so many poses besides")
      ->check(CLI::Range(2, 1'000'000));
  command.add_option("--seed", options->seed, "Of the simulated ones")->capture_default_str();
  command.add_option("--json", options->json, "Result file; times per update and plot beside it");
  command.add_flag("!--no-plots", options->plots, "Write JSON only");
  command.callback([options] { run_guarded("backend", [&] { run_experiment(*options); }); });
}

}  // namespace understory::eval::experiments::backend
