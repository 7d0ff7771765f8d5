#include "eval/experiments/one_shot/one_shot.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/one_shot/trials.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::one_shot {
namespace {

constexpr double kWrongPose_m = 1.0;
constexpr double kOff_m = 0.1;
/// 99.9 % of chi² with 3 degrees of freedom.
constexpr double kUnstated = 16.27;
/// A search that gave up is asked again with so many times the work, to see whether there is an
/// answer.
constexpr std::uint32_t kMorePatience = 20;

struct OneShotOptions {
  int scans = 1500;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string data;
  std::string json;
};

constexpr std::array kMaps{
    MapSource{"longleaf", "tree_maps/longleaf.csv"},
    MapSource{"lansing", "tree_maps/lansing.csv"},
    MapSource{"bei", "tree_maps/bei.csv"},
    MapSource{"spruces", "tree_maps/spruces.csv"},
    MapSource{"waka", "tree_maps/waka.csv"},
    MapSource{"big-woods", "stem_censuses/big_woods.csv", "dbh_2008_cm", 10.0},
    MapSource{"big-woods-all", "stem_censuses/big_woods.csv", "dbh_2014_cm", 1.0}};

constexpr std::array kScanSettings{
    ScanSetting{40.0, 0.2, 0.9, 0.0}, ScanSetting{20.0, 0.2, 0.9, 0.0},
    ScanSetting{40.0, 0.05, 0.9, 0.0}, ScanSetting{40.0, 0.2, 0.6, 0.3}};

/// Scans that gave up although there is an answer: with more work they are found, and right.
int count_missed(const StemMap& map, const ScanSetting& setting, std::span<const Trial> trials,
                 std::span<const std::uint64_t> seeds, const OneShotOptions& options,
                 const std::atomic<bool>& stop) {
  std::vector<std::uint64_t> again;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i].outcome == constellation::LocaliseOutcome::kGaveUp) again.push_back(seeds[i]);
  }
  constellation::LocaliseParameters patient;
  patient.max_lookups *= kMorePatience;
  std::atomic<int> missed = 0;
  tools::run_in_parallel(again.size(), options.jobs, "asked again", stop, [&](std::size_t i) {
    const Trial trial = run_trial(map, setting, again[i], patient);
    if (trial.found() && trial.error_m <= kWrongPose_m) ++missed;
  });
  return missed;
}

nlohmann::json row_of_trials(const StemMap& map, const ScanSetting& setting,
                             std::span<const Trial> trials) {
  std::vector<double> nees;
  std::vector<double> error_m;
  std::vector<double> ms;
  std::vector<double> lookups;
  int wrong = 0;
  int off = 0;
  int unstated = 0;
  for (const Trial& trial : trials) {
    ms.push_back(trial.ms);
    lookups.push_back(trial.work);
    if (!trial.found()) continue;
    nees.push_back(trial.nees);
    error_m.push_back(trial.error_m);
    const bool is_unstated = trial.nees > kUnstated;
    wrong += trial.error_m > kWrongPose_m ? 1 : 0;
    off += trial.error_m > kOff_m && trial.error_m <= kWrongPose_m && is_unstated ? 1 : 0;
    unstated += is_unstated ? 1 : 0;
  }
  double sum = 0.0;
  for (const double one : nees) sum += one;

  return {{"map", map.name},
          {"stems", map.stems_m.size()},
          {"range_m", setting.range_m},
          {"sigma_cm", 100.0 * setting.sigma_m},
          {"detection_pct", 100.0 * setting.detection},
          {"false_pct", 100.0 * setting.false_share},
          {"scans", trials.size()},
          {"found", nees.size()},
          {"wrong", wrong},
          {"off_unstated", off},
          {"beyond_99_9_pct", unstated},
          {"nees_mean", nees.empty() ? 0.0 : sum / static_cast<double>(nees.size())},
          {"nees_p99_9", tools::quantile(nees, 0.999)},
          {"error_p50_cm", 100.0 * tools::quantile(error_m, 0.5)},
          {"error_max_cm", 100.0 * tools::quantile(error_m, 1.0)},
          {"lookups_max", tools::quantile(lookups, 1.0)},
          {"ms_p50", tools::quantile(ms, 0.5)},
          {"ms_p99", tools::quantile(ms, 0.99)},
          {"ms_max", tools::quantile(ms, 1.0)}};
}

void print_heading() {
  fmt::print(
      "{:<14} {:>5} {:>5} {:>4} {:>4} {:>6} {:>6} {:>5} {:>4} {:>6} {:>7} {:>6} {:>6} {:>7} "
      "{:>8} {:>7} {:>7}\n",
      "map", "range", "sigma", "det", "fls", "scans", "found", "wrong", "off", "> 99.9", "missed",
      "NEES", "p99.9", "p50 cm", "max cm", "p50 ms", "max ms");
}

void print_cell(const nlohmann::json& row) {
  const auto n = [&](const char* key) { return row[key].get<int>(); };
  const auto x = [&](const char* key) { return row[key].get<double>(); };
  fmt::print(
      "{:<14} {:>5.0f} {:>5.0f} {:>4.0f} {:>4.0f} {:>6} {:>6} {:>5} {:>4} {:>6} {:>7} "
      "{:>6.2f} {:>6.1f} {:>7.2f} {:>8.1f} {:>7.2f} {:>7.1f}\n",
      row["map"].get<std::string>(), x("range_m"), x("sigma_cm"), x("detection_pct"),
      x("false_pct"), n("scans"), n("found"), n("wrong"), n("off_unstated"), n("beyond_99_9_pct"),
      n("gave_up_with_answer"), x("nees_mean"), x("nees_p99_9"), x("error_p50_cm"),
      x("error_max_cm"), x("ms_p50"), x("ms_max"));
  std::fflush(stdout);
}

nlohmann::json run_cell(const StemMap& map, const ScanSetting& setting, std::uint64_t cell,
                        const OneShotOptions& options, const std::atomic<bool>& stop) {
  std::vector<std::uint64_t> seeds(static_cast<std::size_t>(options.scans));
  for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = trial_seed(options.seed, cell, i);
  std::vector<Trial> trials(seeds.size());
  tools::run_in_parallel(seeds.size(), options.jobs, map.name, stop,
                         [&](std::size_t i) { trials[i] = run_trial(map, setting, seeds[i], {}); });
  nlohmann::json row = row_of_trials(map, setting, trials);
  row["gave_up_with_answer"] = count_missed(map, setting, trials, seeds, options, stop);
  return row;
}

void run_one_shot(const OneShotOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  std::filesystem::path data = options.data;
  if (data.empty()) {
    const char* set = std::getenv("UNDERSTORY_DATA");
    data = set != nullptr ? set : "../shared/data";
  }

  nlohmann::json rows = nlohmann::json::array();
  print_heading();
  for (const MapSource& source : kMaps) {
    const StemMap map = load_map(source, data);
    for (const ScanSetting& setting : kScanSettings) {
      rows.push_back(run_cell(map, setting, rows.size(), options, stop));
      print_cell(rows.back());
    }
  }
  fmt::print(
      "wrong: > 1 m off; off: 0.1 to 1 m off and outside the 99.9 % ellipsoid (NEES > 16.27, 3 "
      "degrees\nof freedom); missed: gave up, found with {} times the work\n",
      kMorePatience);
  if (options.json.empty()) return;
  const nlohmann::json config{{"seed", options.seed}, {"scans", options.scans}};
  harness::write_json(options.json, harness::result_document("one-shot", config, rows));
}

}  // namespace

void add_one_shot_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "one-shot", "Single scans located in surveyed stem maps: wrong ones, NEES, work");
  const auto options = std::make_shared<OneShotOptions>();
  add_number(command, "--scans", options->scans, 1, 1000000, "Scans per map and setting");
  command.add_option("--seed", options->seed, "Seed")->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Jobs side by side");
  command.add_option("--data", options->data,
                     "Folder with tree_maps and stem_censuses; default $UNDERSTORY_DATA");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("one-shot", [&] { run_one_shot(*options); }); });
}

}  // namespace understory::eval::experiments::one_shot
