#include "eval/experiments/changing_forest/mapping_needed.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <set>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/existence/scores.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/drive_map.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::changing_forest {
namespace {

constexpr std::array<const char*, 3> kSignals{"missing", "new", "sum"};

struct NeedCommand {
  DrivesOptions drives;
  std::vector<double> changed{0.05, 0.1, 0.2, 0.35, 0.5};
  int runs = 4;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;
};

/// What no change explains comes first.
std::vector<NeedSetting> settings_of(const NeedCommand& options) {
  std::vector<NeedSetting> settings{
      {"nothing changed", Part::kChanges, 0.0, 0.0},
      {"a stack of timber", Part::kStack, 0.0, 0.0},
      {"10 % false detections", Part::kFalseDetections, 0.0, 0.1},
      {"30 % false detections", Part::kFalseDetections, 0.0, 0.3},
  };
  for (const double changed : options.changed)
    settings.push_back({fmt::format("{:.0f} % changed", 100.0 * changed), Part::kChanges, changed});
  return settings;
}

/// Mapped once, driven once more: what the second drive says.
NeedScore drive_again(const NeedCommand& options, const NeedSetting& setting, std::uint64_t seed,
                      const std::string& folder_name) {
  DrivesOptions drives = options.drives;
  drives.forest.drives = 2;
  drives.forest.share = setting.changed;
  const auto forest = forest_for(setting.part, drives, seed);
  const harness::MapFolder folder(folder_name);
  const Variant variant{setting.part, Keeping::kTracker, setting.false_share};
  const std::vector<DriveScore> scores =
      drive_forest(forest, drives, variant, seed, folder.path(),
                   [](double) { terminal::throw_if_interrupted(); });
  return need_of(setting, seed, scores.back().signals);
}

nlohmann::json row_of(const NeedScore& score) {
  nlohmann::json row{{"part", "drive"},
                     {"setting", score.setting.name},
                     {"changed_pct", 100.0 * score.setting.changed},
                     {"run_seed", score.seed},
                     {"needed_pct", score.needed_pct}};
  for (std::size_t i = 0; i < kSignals.size(); ++i) row[kSignals[i]] = score.most[i];
  return row;
}

/// Drives of which so many trees changed against those where none did; with detections that are
/// false among these, or without.
nlohmann::json area_row(std::span<const NeedScore> scores, double share, std::size_t signal,
                        bool has_false) {
  // A drive without a change "exists", and P is the signal's opposite.
  std::vector<existence::ScoredPoint> drives;
  double changed = 0.0;
  for (const NeedScore& score : scores) {
    const NeedSetting& setting = score.setting;
    if (setting.is_changed() && setting.changed != share) continue;
    if (setting.false_share > 0.0 && !has_false) continue;
    drives.push_back({-score.most[signal], !setting.is_changed()});
    changed += setting.is_changed() ? 1.0 : 0.0;
  }

  const double unchanged = static_cast<double>(drives.size()) - changed;
  const double area = existence::roc_area(drives);
  return {{"part", "area"},
          {"signal", kSignals[signal]},
          {"changed_pct", 100.0 * share},
          {"has_false", has_false},
          {"changed_drives", changed},
          {"unchanged_drives", unchanged},
          {"auc", area},
          {"auc_half95", 1.96 * existence::sigma_of_area(area, changed, unchanged)}};
}

void print_needs(std::span<const NeedScore> scores, const nlohmann::json& areas) {
  fmt::print("{:<24} {:>6} {:>9} {:>6} {:>6} {:>9}\n", "second drive", "seed", "missing", "new",
             "sum", "asked %");
  for (const NeedScore& score : scores)
    fmt::print("{:<24} {:>6} {:>9.2f} {:>6.2f} {:>6.2f} {:>9.0f}\n", score.setting.name, score.seed,
               score.most[0], score.most[1], score.most[2], score.needed_pct);
  for (const nlohmann::json& area : areas)
    fmt::print("{:>4.0f} % changed, {:<8} {:<26} AUC {:.3f} +- {:.3f}\n",
               area["changed_pct"].get<double>(), area["signal"].get<std::string>(),
               area["has_false"].get<bool>() ? "against all" : "against true detections",
               area["auc"].get<double>(), area["auc_half95"].get<double>());
}

void run_needs(const NeedCommand& options) {
  const auto& stop = terminal::catch_interrupts();
  const std::vector<NeedSetting> settings = settings_of(options);
  std::vector<NeedScore> scores(settings.size() * static_cast<std::size_t>(options.runs));
  tools::run_in_parallel(scores.size(), options.jobs, "drives", stop, [&](std::size_t i) {
    const auto run = static_cast<int>(i / settings.size());
    scores[i] =
        drive_again(options, settings[i % settings.size()], harness::run_seed(options.seed, run),
                    fmt::format("existence-needed-{}", i));
  });

  const nlohmann::json areas = need_areas(scores);
  print_needs(scores, areas);
  if (options.json.empty()) return;
  nlohmann::json rows = areas;
  for (const NeedScore& score : scores) rows.push_back(row_of(score));
  const nlohmann::json config{{"seed", options.seed},
                              {"runs", options.runs},
                              {"length_m", options.drives.forest.course.length_m},
                              {"stack_m", options.drives.stack_m}};
  harness::write_json(options.json, harness::result_document("existence-needed", config, rows));
  harness::plot("existence_needed.py", {options.json});
}

}  // namespace

NeedScore need_of(const NeedSetting& setting, std::uint64_t seed,
                  std::span<const harness::MappingSignal> signals) {
  NeedScore score{setting, seed, {}, 0.0};
  std::size_t needed = 0;
  for (const harness::MappingSignal& signal : signals) {
    const std::array<double, 3> now{signal.missing_share, signal.new_share,
                                    signal.missing_share + signal.new_share};
    for (std::size_t i = 0; i < now.size(); ++i) score.most[i] = std::max(score.most[i], now[i]);
    needed += signal.is_needed ? 1 : 0;
  }
  if (!signals.empty())
    score.needed_pct = 100.0 * static_cast<double>(needed) / static_cast<double>(signals.size());
  return score;
}

nlohmann::json need_areas(std::span<const NeedScore> scores) {
  std::set<double> shares;
  for (const NeedScore& score : scores)
    if (score.setting.is_changed()) shares.insert(score.setting.changed);

  nlohmann::json rows = nlohmann::json::array();
  for (const bool has_false : {false, true})
    for (const double share : shares)
      for (std::size_t i = 0; i < kSignals.size(); ++i)
        rows.push_back(area_row(scores, share, i, has_false));
  return rows;
}

void add_mapping_needed_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "existence-needed", "Whether a drive in an old map says that mapping is needed");
  const auto options = std::make_shared<NeedCommand>();
  options->drives.forest.course.length_m = 150.0;
  command.add_option("--changed", options->changed, "Shares of the trees that were felled")
      ->delimiter(',')
      ->check(CLI::Range(0.01, 0.9))
      ->capture_default_str();
  add_number(command, "--runs", options->runs, 1, 1000, "Forests, each with every change");
  command.add_option("--seed", options->seed, "Seed of the first forest")->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Runs side by side");
  add_number(command, "--length-m", options->drives.forest.course.length_m, 30.0, 10000.0,
             "Length of the path [m]");
  command.add_option("--config", options->drives.config_dir, "Configuration folder of the chain")
      ->capture_default_str();
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("existence-needed", [&] { run_needs(*options); }); });
}

}  // namespace understory::eval::experiments::changing_forest
