#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <string_view>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/existence/camera/camera_rows.hpp"
#include "eval/experiments/existence/camera/existence_camera.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

using sim::changes::SceneKind;

constexpr std::uint64_t kTunedOn = 100001;
constexpr std::array<SceneKind, 3> kScenes{SceneKind::kOffice, SceneKind::kStation,
                                           SceneKind::kForest};
constexpr std::array<double, 6> kShares{0.0, 0.05, 0.1, 0.2, 0.35, 0.5};
/// Of those of `eval existence`; the first is the one that removes nothing.
constexpr std::array<std::string_view, 9> kCompared{
    "no removal", "log-odds counter", "persistence filter", "joint persistence filter",
    "Perpetua",   "thesis's rules",   "icosahedral",        "von Mises-Fisher",
    "ideal"};
/// The one whose P says which points are in use, and that is also given the rays.
constexpr std::string_view kOurs = "icosahedral";
/// The same without one of its parts, or with one more: only their points are scored.
constexpr std::array<std::string_view, 5> kAblations{
    "icosahedral, neighbours", "icosahedral, no decay", "icosahedral, no redundancy control",
    "icosahedral, looks alone", "icosahedral, recall as told"};

struct CameraOptions {
  int runs = 3;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;
  bool no_plots = false;
};

/// One small change, one large, one between: a world each.
std::vector<History> training_of(const CameraOptions& options, const std::atomic<bool>& stop) {
  constexpr std::array<double, 3> kTrainingShares{0.2, 0.05, 0.5};
  std::vector<History> training(kScenes.size());
  tools::run_in_parallel(training.size(), options.jobs, "training worlds", stop,
                         [&](std::size_t i) {
                           CaseSetting setting;
                           setting.scene = kScenes[i];
                           setting.changed = kTrainingShares[i];
                           training[i] = without_rays(make_case(setting, kTunedOn, false).history);
                         });
  return training;
}

std::vector<CameraMethod> tuned_for_cameras(const CameraOptions& options,
                                            const std::atomic<bool>& stop) {
  const std::vector<History> training = training_of(options, stop);
  const std::vector<MethodKind> kinds = method_kinds(training);
  std::vector<std::string_view> names(kCompared.begin(), kCompared.end());
  names.insert(names.end(), kAblations.begin(), kAblations.end());
  std::vector<CameraMethod> methods(names.size());
  tools::run_in_parallel(methods.size(), options.jobs, "tuning", stop, [&](std::size_t i) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                   [&](const MethodKind& one) { return one.name == names[i]; });
    methods[i].tuned = tune(*kind, training);
    methods[i].is_ablation = i >= kCompared.size();
  });

  const auto ours = std::find_if(methods.begin(), methods.end(), [](const CameraMethod& method) {
    return method.tuned.name == kOurs;
  });
  CameraMethod with_rays = *ours;
  with_rays.tuned.name += ", disparities";
  with_rays.has_rays = true;
  methods.insert(ours + 1, with_rays);
  return methods;
}

/// All shares of change in one world, and occluders alone.
void add_settings(CaseSetting setting, std::vector<CaseSetting>& all) {
  for (const double share : kShares) {
    all.push_back(setting);
    all.back().changed = share;
  }
  setting.changed = 0.0;
  setting.has_occluders_alone = true;
  all.push_back(setting);
}

std::vector<CaseSetting> camera_settings() {
  std::vector<CaseSetting> all;
  for (const SceneKind scene : kScenes) {
    for (const bool has_bare_walls : {false, true}) {
      if (scene == SceneKind::kForest && has_bare_walls) continue;
      CaseSetting setting;
      setting.scene = scene;
      setting.has_bare_walls = has_bare_walls;
      add_settings(setting, all);
    }
  }
  return all;
}

std::vector<CaseResult> run_cases(const CameraOptions& options,
                                  const std::vector<CameraMethod>& methods,
                                  const std::atomic<bool>& stop) {
  const std::vector<CaseSetting> settings = camera_settings();
  const auto runs = static_cast<std::size_t>(options.runs);
  const auto ours = std::find(kCompared.begin(), kCompared.end(), kOurs) - kCompared.begin();
  std::vector<CaseResult> cases(settings.size() * runs);
  tools::run_in_parallel(cases.size(), options.jobs, "worlds", stop, [&](std::size_t i) {
    cases[i] = run_case(settings[i / runs], options.seed + i % runs, methods,
                        static_cast<std::size_t>(ours));
  });
  return cases;
}

/// An ablation has no frames.
void print_culling(const nlohmann::json& row) {
  const auto shown = [&row](const char* key) { return row.value(key, 0.0); };
  fmt::print(
      "{:<19} {:>4.0f}{} {:<34} {:>5.0f} {:>6.1f} [{:>5.1f} {:>5.1f}] {:>3.0f} {:>7.1f} {:>5.1f} "
      "{:>6.2f} {:>5.1f} {:>6.0f} | {:>6.0f} {:>5.1f} {:>6.1f} {:>6.2f} {:>7.4f} {:>7.4f} | "
      "{:>5.1f} | "
      "{:>6.1f} {:>6.2f} {:>7.4f}\n",
      row["world"].get<std::string>(), shown("changed_pct"),
      row["occluders_alone"].get<bool>() ? "o" : " ", row["method"].get<std::string>(),
      shown("frames"), shown("success_pct"), shown("success_low_pct"), shown("success_high_pct"),
      shown("wrong_accepted"), shown("samples_mean"), shown("error_p50_cm"), shown("ate_cm"),
      shown("lost_pct"), shown("map_points"), shown("scored_points"), shown("gone_of_scored_pct"),
      shown("gone_removed_pct"), shown("wrongly_removed_pct"), shown("auc"), shown("brier"),
      shown("hidden_removed_pct"), shown("all_gone_removed_pct"), shown("all_wrongly_removed_pct"),
      shown("all_auc"));
}

void print_needed(const nlohmann::json& row) {
  fmt::print(
      "mapping needed: {:<19} {:<9} {:>3.0f}-{:>3.0f} % {:<5} {:<26} AUC {:.4f} +- {:.4f} ({} / {} "
      "drives), mean {:.3f} / {:.3f}\n",
      row["world"].get<std::string>(), row["with_occluded"].get<bool>() ? "occluded" : "plain",
      row["from_pct"].get<double>(), row["to_pct"].get<double>(), row["drives"].get<std::string>(),
      row["signal"].get<std::string>(), row["auc"].get<double>(), row["auc_half95"].get<double>(),
      row["changed_drives"].get<double>(), row["unchanged_drives"].get<double>(),
      row["mean_changed"].get<double>(), row["mean_unchanged"].get<double>());
}

nlohmann::json rows_of(const std::vector<CaseResult>& cases, std::size_t runs,
                       const std::vector<CameraMethod>& methods) {
  fmt::print(
      "world   changed method                           frames success [95 %]    wrong samples  cm "
      "  "
      "ATE cm  lost  points | scored gone% removed wrong%  AUC    Brier | all: removed, "
      "wrong, AUC\n");
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t first = 0; first < cases.size(); first += runs) {
    std::vector<const CaseResult*> of_setting;
    for (std::size_t i = first; i < first + runs; ++i) of_setting.push_back(&cases[i]);
    for (nlohmann::json& row : culling_rows(of_setting, methods)) {
      print_culling(row);
      rows.push_back(std::move(row));
    }
  }
  for (nlohmann::json& row : mapping_needed_rows(cases)) {
    print_needed(row);
    rows.push_back(std::move(row));
  }
  return rows;
}

void run_existence_camera(const CameraOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  const std::vector<CameraMethod> methods = tuned_for_cameras(options, stop);
  const std::vector<CaseResult> cases = run_cases(options, methods, stop);
  const nlohmann::json rows = rows_of(cases, static_cast<std::size_t>(options.runs), methods);
  if (options.json.empty()) return;

  nlohmann::json tuned;
  for (const CameraMethod& method : methods) tuned[method.tuned.name] = method.tuned.tuned;
  const nlohmann::json config{{"seed", options.seed}, {"runs", options.runs}, {"tuned", tuned}};
  harness::write_json(options.json, harness::result_document("existence-camera", config, rows));
  const auto traces = harness::traces_file(options.json);
  harness::write_json(traces, {{"mapping_needed", mapping_needed_curves(cases)}});
  if (!options.no_plots) harness::plot("existence_camera.py", {options.json, traces.string()});
}

}  // namespace

void add_existence_camera_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "existence-camera",
      "Effect of culling on a camera's later visits: relocalisation, tracking, mapping needed");
  const auto options = std::make_shared<CameraOptions>();
  add_number(command, "--runs", options->runs, 1, 1000, "Worlds per kind and share");
  command.add_option("--seed", options->seed, "Seed of the first world; tuned on 100001")
      ->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Jobs side by side");
  command.add_option("--json", options->json, "Result document");
  command.add_flag("--no-plots", options->no_plots, "No pictures");
  command.callback(
      [options] { run_guarded("existence-camera", [&] { run_existence_camera(*options); }); });
}

}  // namespace understory::eval::experiments::existence::camera
