// eval efficiency (GeoSLAM §5.5, Fig. 5.1): time per keyframe along the run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"
#include "eval/harness/slam_session.hpp"
#include "eval/harness/submap_shelf.hpp"
#include "eval/tools/memory.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "eval/tools/yardstick.hpp"

namespace understory::eval::experiments::efficiency {
namespace {

struct EfficiencyOptions {
  harness::CampaignOptions campaign;
  double drive_km = 10.0;
  double stationary_h = 2.0;
  double hand_over_m = 0.0;
};

/// One drive that is timed.
struct Scenario {
  std::string name;
  sim::DriveParameters drive;
  std::vector<std::string> methods;
};

struct KeyframeTime {
  double position = 0.0;  ///< Metres driven, or hours stationary, up to this keyframe.
  double keyframer_ms = 0.0;
  double mapper_ms = 0.0;
};

struct Timing {
  std::string scenario;
  std::string method;
  std::vector<KeyframeTime> keyframes;
  std::size_t updates = 0;
  std::size_t landmarks = 0;
  double rss_mb = 0.0;  ///< Of the whole process, at the end.
};

std::vector<Scenario> scenarios(const EfficiencyOptions& options) {
  const auto& methods = options.campaign.methods;
  std::vector<Scenario> result(1);
  result[0].name = "circle-200m";
  result[0].methods = methods;

  if (options.drive_km > 0.0) {
    Scenario scenario;
    scenario.name = fmt::format("drive-{:g}km", options.drive_km);
    scenario.drive.path.kind = sim::PathKind::kMeander;
    scenario.drive.path.length_m = 1000.0 * options.drive_km;
    scenario.drive.clear_the_path = true;
    result.push_back(scenario);
  }

  if (options.stationary_h > 0.0) {
    Scenario scenario;
    scenario.name = fmt::format("stationary-{:g}h", options.stationary_h);
    scenario.drive.path.kind = sim::PathKind::kStationary;
    scenario.drive.path.length_m = 3600.0 * options.stationary_h * scenario.drive.speed_mps;
    result.push_back(scenario);
  }

  // The cost of the baseline grows without bound: it is left out of the long drives.
  for (std::size_t i = 1; i < result.size(); ++i) {
    if (std::find(methods.begin(), methods.end(), "smoothing") != methods.end()) {
      result[i].methods = {"smoothing"};
    }
  }
  return result;
}

Timing time_drive(const Scenario& scenario, const std::string& method,
                  const EfficiencyOptions& options, const std::atomic<bool>& stop) {
  const sim::Drive drive(scenario.drive, harness::run_seed(options.campaign.seed, 0));
  harness::SlamSession session(harness::make_stages(method, options.hand_over_m));
  harness::SubmapShelf shelf;
  Timing timing{scenario.name, method, {}, 0, 0, 0.0};
  terminal::Progress progress(fmt::format("scans, {} {}", scenario.name, method),
                              static_cast<double>(drive.size()),
                              terminal::Progress::Without::kSeconds);

  const bool is_stationary = scenario.drive.path.kind == sim::PathKind::kStationary;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (stop) throw terminal::Interrupted{};
    const auto outcome = session.feed(drive.scan(k).scan);
    progress.advance();
    if (!outcome) continue;

    const double begin_s = tools::thread_time_s();
    session.mapper().exchange_submaps(shelf);
    const double mapper_s = outcome->mapper_s + tools::thread_time_s() - begin_s;

    const double driven = static_cast<double>(k + 1) * scenario.drive.path.interval;
    timing.keyframes.push_back({is_stationary ? driven / scenario.drive.speed_mps / 3600.0 : driven,
                                1e3 * outcome->keyframer_s, 1e3 * mapper_s});

    const model::MapUpdateStatus status = outcome->update.status;
    if (status == model::MapUpdateStatus::kUpdated || status == model::MapUpdateStatus::kFirstMap) {
      ++timing.updates;
    }
  }

  timing.landmarks = session.mapper().landmarks().size() + shelf.landmarks();
  timing.rss_mb = tools::resident_mb();
  return timing;
}

/// One row per component, and one for the whole; `first` and `last` are medians of a tenth of the
/// run: flat cost has them equal.
nlohmann::json rows_of(const Timing& timing, double yardstick_s) {
  nlohmann::json rows = nlohmann::json::array();
  const auto add = [&](const std::string& component, auto value) {
    std::vector<double> all;
    for (const KeyframeTime& keyframe : timing.keyframes) all.push_back(value(keyframe));
    const auto tenth = static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, all.size() / 10));
    if (all.empty()) return;

    rows.push_back(
        {{"method", timing.method},
         {"scenario", timing.scenario},
         {"component", component},
         {"keyframes", all.size()},
         {"updates", timing.updates},
         {"landmarks", timing.landmarks},
         {"ms_p50", tools::quantile(all, 0.5)},
         {"ms_p99", tools::quantile(all, 0.99)},
         {"ms_max", tools::quantile(all, 1.0)},
         {"ms_p50_first_tenth", tools::quantile({all.begin(), all.begin() + tenth}, 0.5)},
         {"ms_p50_last_tenth", tools::quantile({all.end() - tenth, all.end()}, 0.5)},
         {"p50_per_yardstick", tools::quantile(all, 0.5) / (1e3 * yardstick_s)},
         {"rss_mb", timing.rss_mb}});
  };

  add("keyframer", [](const KeyframeTime& t) { return t.keyframer_ms; });
  add("mapper", [](const KeyframeTime& t) { return t.mapper_ms; });
  add("all", [](const KeyframeTime& t) { return t.keyframer_ms + t.mapper_ms; });
  return rows;
}

void print_rows(const nlohmann::json& rows, double yardstick_s) {
  fmt::print("{:<14} {:<7} {:<10} {:>9} {:>9} {:>9} {:>9} {:>11} {:>10} {:>8} {:>7}\n", "scenario",
             "method", "component", "keyframes", "p50 ms", "p99 ms", "max ms", "first tenth",
             "last tenth", "/Delaun.", "RSS MB");
  for (const nlohmann::json& row : rows) {
    fmt::print(
        "{:<14} {:<7} {:<10} {:>9} {:>9.3f} {:>9.3f} {:>9.3f} {:>11.3f} {:>10.3f} {:>8.4f} "
        "{:>7.0f}\n",
        row["scenario"].get<std::string>(), row["method"].get<std::string>(),
        row["component"].get<std::string>(), row["keyframes"].get<std::size_t>(),
        row["ms_p50"].get<double>(), row["ms_p99"].get<double>(), row["ms_max"].get<double>(),
        row["ms_p50_first_tenth"].get<double>(), row["ms_p50_last_tenth"].get<double>(),
        row["p50_per_yardstick"].get<double>(), row["rss_mb"].get<double>());
  }
  fmt::print("yardstick: CGAL Delaunay of 13,770 points in {:.2f} ms\n", 1e3 * yardstick_s);
}

nlohmann::json trace_of(const Timing& timing) {
  nlohmann::json trace{{"scenario", timing.scenario}, {"method", timing.method}};
  for (const KeyframeTime& keyframe : timing.keyframes) {
    trace["position"].push_back(keyframe.position);
    trace["keyframer_ms"].push_back(keyframe.keyframer_ms);
    trace["mapper_ms"].push_back(keyframe.mapper_ms);
  }
  return trace;
}

void run_efficiency(const EfficiencyOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  const double yardstick_s = tools::delaunay_build_s();
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json traces = nlohmann::json::array();

  for (const Scenario& scenario : scenarios(options)) {
    for (const std::string& method : scenario.methods) {
      if (method == "oracle") continue;
      const Timing timing = time_drive(scenario, method, options, stop);
      for (const nlohmann::json& row : rows_of(timing, yardstick_s)) rows.push_back(row);
      traces.push_back(trace_of(timing));
    }
  }

  print_rows(rows, yardstick_s);
  if (options.campaign.json.empty()) return;

  const std::filesystem::path file = options.campaign.json;
  const nlohmann::json config{{"seed", options.campaign.seed},
                              {"drive_km", options.drive_km},
                              {"stationary_h", options.stationary_h},
                              {"hand_over_m", options.hand_over_m},
                              {"yardstick_ms", 1e3 * yardstick_s}};
  harness::write_json(harness::traces_file(file), traces);
  harness::write_json(file, harness::result_document("efficiency", config, rows));
  if (options.campaign.plots)
    harness::plot("efficiency.py", {file, harness::traces_file(file).string()});
}

}  // namespace

void add_efficiency_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "efficiency", "Time per keyframe: 200 m, a long drive, stationary (one run, one job)");
  const auto options = std::make_shared<EfficiencyOptions>();
  add_campaign_options(command, options->campaign);
  add_number(command, "--drive-km", options->drive_km, 0.0, 1000.0,
             "Length of the long drive; 0 = none");
  add_number(command, "--stationary-h", options->stationary_h, 0.0, 1000.0,
             "Hours stationary; 0 = none");
  add_number(command, "--hand-over-m", options->hand_over_m, 0.0, 1e6,
             "Map parts farther from the vehicle than this go to the disk [m]; 0 = none");
  command.callback([options] { run_guarded("efficiency", [&] { run_efficiency(*options); }); });
}

}  // namespace understory::eval::experiments::efficiency
