#include "eval/experiments/merges/merges.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <span>
#include <string>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/merges/pairs.hpp"
#include "eval/experiments/one_shot/trials.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"
#include "eval/tools/quantile.hpp"
#include "sim/forest.hpp"

namespace understory::eval::experiments::merges {
namespace {

struct MergesOptions {
  int trials = 50;
  int drives = 20;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string data;
  std::string json;
};

constexpr std::array kForests{
    one_shot::MapSource{"longleaf", "tree_maps/longleaf.csv"},
    one_shot::MapSource{"lansing", "tree_maps/lansing.csv"},
    one_shot::MapSource{"bei", "tree_maps/bei.csv"},
    one_shot::MapSource{"big-woods", "stem_censuses/big_woods.csv", "dbh_2008_cm", 10.0}};
/// The last one of them, six years later.
constexpr one_shot::MapSource kLater{"big-woods", "stem_censuses/big_woods.csv", "dbh_2014_cm",
                                     10.0};
/// As shares of a map's width; the last one is a gap.
constexpr std::array kOverlaps{1.0, 0.5, 0.25, -0.1};
/// Two visits of a forest share 62-64 % of their stems in the median, 34 % at worst.
constexpr std::array kShares{0.64, 0.34};

struct NamedDrives {
  const char* name;
  DriveSetting setting;
};
constexpr std::array kDrives{
    NamedDrives{"two drives, 64 % of the stems each", DriveSetting{}},
    NamedDrives{"two vehicles on one day", DriveSetting{.side_m = 300.0, .seen = 1.0}}};

nlohmann::json row_of_merges(std::span<const MergeTrial> trials) {
  std::vector<double> offset_m;
  std::vector<double> sigma_m;
  std::vector<double> ms;
  std::size_t wrong = 0;
  std::size_t landmarks = 0;
  std::size_t doubled = 0;
  std::size_t doubled_before = 0;
  double nees = 0.0;
  double share = 0.0;
  for (const MergeTrial& trial : trials) {
    ms.push_back(trial.ms);
    wrong += trial.wrong ? 1 : 0;
    if (!trial.merged || trial.wrong) continue;
    offset_m.push_back(trial.offset_m);
    sigma_m.push_back(trial.sigma_m);
    landmarks += trial.landmarks;
    doubled += trial.doubled;
    doubled_before += trial.doubled_before;
    nees += trial.nees;
    share += trial.share;
  }

  const auto right = static_cast<double>(std::max<std::size_t>(1, offset_m.size()));
  const auto percent = [&](std::size_t count) {
    return 100.0 * static_cast<double>(count) /
           static_cast<double>(std::max<std::size_t>(1, landmarks));
  };
  return {{"trials", trials.size()},
          {"merged", offset_m.size() + wrong},
          {"wrong_merges", wrong},
          {"share_pct", 100.0 * share / right},
          {"doubled_pct", percent(doubled)},
          {"doubled_before_pct", percent(doubled_before)},
          {"offset_p50_m", tools::quantile(offset_m, 0.5)},
          {"offset_max_m", tools::quantile(offset_m, 1.0)},
          {"stated_sigma_p50_m", tools::quantile(sigma_m, 0.5)},
          {"nees_mean", nees / right},
          {"ms_p50", tools::quantile(ms, 0.5)},
          {"ms_max", tools::quantile(ms, 1.0)}};
}

void print_merges_heading() {
  fmt::print("{:<36} {:>7} {:>6} {:>6} {:>6} {:>5} {:>8} {:>9} {:>7} {:>7} {:>5} {:>7}\n", "maps",
             "overlap", "common", "trials", "merged", "wrong", "double %", "offset cm", "max cm",
             "sigma", "NEES", "ms");
}

void print_merges(const nlohmann::json& row) {
  const auto x = [&](const char* key) { return row[key].get<double>(); };
  const auto& overlap = row["overlap_pct"];
  fmt::print(
      "{:<36} {:>7} {:>6.0f} {:>6} {:>6} {:>5} {:>8.2f} {:>9.1f} {:>7.1f} {:>7.1f} {:>5.2f} "
      "{:>7.0f}\n",
      row["maps"].get<std::string>(),
      overlap.is_null() ? "drawn" : fmt::format("{:.0f}", overlap.get<double>()), x("common_pct"),
      row["trials"].get<int>(), row["merged"].get<int>(), row["wrong_merges"].get<int>(),
      x("doubled_pct"), 100.0 * x("offset_p50_m"), 100.0 * x("offset_max_m"),
      100.0 * x("stated_sigma_p50_m"), x("nees_mean"), x("ms_p50"));
  std::fflush(stdout);
}

/// Trials of one kind as a row; `make` makes the pair of maps of a seed.
nlohmann::json run_merges(const std::string& name, int trials, const MergesOptions& options,
                          std::uint64_t cell, const std::atomic<bool>& stop,
                          const std::function<MapPair(std::uint64_t)>& make) {
  std::vector<MergeTrial> results(static_cast<std::size_t>(trials));
  tools::run_in_parallel(results.size(), options.jobs, name, stop, [&](std::size_t i) {
    results[i] = merge_trial(make(one_shot::trial_seed(options.seed, cell, i)));
  });
  nlohmann::json row = row_of_merges(results);
  row["maps"] = name;
  return row;
}

class MergesTable {
 public:
  MergesTable(const MergesOptions& options, const std::atomic<bool>& stop)
      : options_(options), stop_(stop) {
    print_merges_heading();
  }

  void add_forest(const std::string& name, const Visits& visits) {
    for (const double overlap : kOverlaps) {
      for (const double common : kShares) {
        CutSetting setting;
        setting.overlap = overlap;
        setting.common = common;
        add(name, overlap, common, options_.trials,
            [&](std::uint64_t seed) { return cut_maps(visits, setting, seed); });
      }
    }
  }
  void add_drives(const NamedDrives& drives) {
    // Where both drive is drawn: what the maps have of each other differs.
    add(drives.name, std::nullopt, drives.setting.seen, options_.drives,
        [&](std::uint64_t seed) { return drive_maps(drives.setting, seed, stop_); });
  }
  const nlohmann::json& rows() const { return rows_; }

 private:
  void add(const std::string& name, std::optional<double> overlap, double common, int trials,
           const std::function<MapPair(std::uint64_t)>& make) {
    nlohmann::json row = run_merges(name, trials, options_, rows_.size(), stop_, make);
    row["overlap_pct"] = nullptr;
    if (overlap) row["overlap_pct"] = 100.0 * std::max(0.0, *overlap);
    row["common_pct"] = 100.0 * common;
    print_merges(row);
    rows_.push_back(std::move(row));
  }

  const MergesOptions& options_;
  const std::atomic<bool>& stop_;
  nlohmann::json rows_ = nlohmann::json::array();
};

std::vector<Eigen::Vector2d> simulated_forest(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = 500.0;
  return sim::make_forest(parameters, random).trunks_m;
}

void run_map_merges(const MergesOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  const char* const set = std::getenv("UNDERSTORY_DATA");
  const std::filesystem::path data =
      !options.data.empty() ? options.data : std::string(set != nullptr ? set : "../shared/data");
  MergesTable table(options, stop);
  for (const NamedDrives& drives : kDrives) table.add_drives(drives);
  table.add_forest("simulated", unchanged(simulated_forest(options.seed)));
  for (const one_shot::MapSource& source : kForests)
    table.add_forest(source.name, unchanged(one_shot::load_map(source, data).stems_m));
  table.add_forest("big-woods, 2008 and 2014",
                   visits_of(one_shot::load_map(kForests.back(), data).stems_m,
                             one_shot::load_map(kLater, data).stems_m));

  int apart = 0;
  int wrong = 0;
  for (const nlohmann::json& row : table.rows()) {
    wrong += row["wrong_merges"].get<int>();
    if (row["overlap_pct"] == 0.0) apart += row["trials"].get<int>();
  }
  fmt::print(
      "wrong merges: {} in all, {} pairs of maps did not overlap (95 % bound: {:.2f} % of them)\n",
      wrong, apart, apart > 0 ? 300.0 / apart : 100.0);
  if (options.json.empty()) return;
  const nlohmann::json config{
      {"seed", options.seed}, {"trials", options.trials}, {"drives", options.drives}};
  harness::write_json(options.json, harness::result_document("map-merge", config, table.rows()));
}

}  // namespace

void add_map_merge_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "map-merge",
      "Pairs of maps merged without a prior: doubled landmarks, offsets, wrong merges");
  const auto options = std::make_shared<MergesOptions>();
  add_number(command, "--trials", options->trials, 1, 100000,
             "Pairs of maps per forest and setting");
  add_number(command, "--drives", options->drives, 1, 100000, "Pairs of drives per setting");
  command.add_option("--seed", options->seed, "Seed")->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Jobs side by side");
  command.add_option("--data", options->data,
                     "Folder with tree_maps and stem_censuses; default $UNDERSTORY_DATA");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("map-merge", [&] { run_map_merges(*options); }); });
}

}  // namespace understory::eval::experiments::merges
