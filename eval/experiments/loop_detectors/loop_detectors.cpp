#include "eval/experiments/loop_detectors/loop_detectors.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/model/place_scan.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/loop_detectors/detector_trials.hpp"
#include "eval/experiments/loop_detectors/frame_set.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::loop_detectors {
namespace {

namespace fs = std::filesystem;
namespace places = understory::place_recognition;

/// Thresholds are taken from sets made with this added to the seed.
constexpr std::uint64_t kTuningSeed = 1000;

struct LoopOptions {
  std::vector<std::string> sets;
  std::vector<std::string> detectors = places::detector_names();
  std::vector<std::string> verifiers = places::verifier_names();
  TrialOptions trial;
  SetOptions set;
  std::uint64_t drives = 1;         ///< Through each stem map.
  std::optional<double> threshold;  ///< Instead of those from the sets for tuning.
  std::string data;
  std::string json;
  bool plots = true;
};

fs::path data_folder(const LoopOptions& options) {
  if (!options.data.empty()) return options.data;
  const char* const root = std::getenv("UNDERSTORY_DATA");  // NOLINT(concurrency-mt-unsafe)
  return root != nullptr ? fs::path(root) : fs::path("../shared/data");
}

/// A set and what it is for.
struct NamedSet {
  const char* name;
  bool is_tuning;        ///< Thresholds are taken from it.
  bool repeats;          ///< Other drives cost little.
  const char* recorded;  ///< Below the folder of recordings; empty = nothing.
  std::function<FrameSet(const SetOptions&, const fs::path&, const std::atomic<bool>&)> make;
};

NamedSet stem_set(const char* name, bool is_tuning, const char* file, const char* diameter_cm) {
  return {name, is_tuning, true, file,
          [=](const SetOptions& options, const fs::path& path, const std::atomic<bool>&) {
            return stem_map_set(path, diameter_cm, options);
          }};
}

const std::vector<NamedSet>& all_sets() {
  const auto forest = [](const SetOptions& options, const fs::path&,
                         const std::atomic<bool>& stop) { return forest_set(options, stop); };
  const auto town = [](const SetOptions& options, const fs::path&, const std::atomic<bool>& stop) {
    return town_set(options, stop);
  };
  const auto park = [](const SetOptions&, const fs::path& path, const std::atomic<bool>& stop) {
    return victoria_park_set(path, stop);
  };
  const auto kitti = [](const SetOptions& options, const fs::path& path, const std::atomic<bool>&) {
    return kitti_poles_set(path, options);
  };
  static const std::vector<NamedSet> sets{
      {"tuning-forest", true, false, "", forest},
      {"tuning-town", true, false, "", town},
      stem_set("tuning-lansing", true, "tree_maps/lansing.csv", ""),
      {"forest", false, false, "", forest},
      {"town", false, false, "", town},
      {"victoria-park", false, false, "victoria_park_raw/victoria_park_ascii.zip", park},
      {"kitti-00-poles", false, true, "pole_maps", kitti},
      stem_set("longleaf", false, "tree_maps/longleaf.csv", ""),
      stem_set("waka", false, "tree_maps/waka.csv", ""),
      stem_set("big-woods", false, "stem_censuses/big_woods.csv", "dbh_2008_cm")};
  return sets;
}

/// Of detector and verifier, the highest score of a wrong answer in the sets for tuning.
using Thresholds = std::map<std::pair<std::string, std::string>, double>;

nlohmann::json row_of(const NamedSet& set, const Answers& answers, double threshold) {
  const DetectorScore score = score_of(answers.answers, threshold);
  std::vector<double> ms, error_m;
  for (const Answer& answer : answers.answers) {
    ms.push_back(answer.ms);
    if (answer.is_right && answer.has_pose) error_m.push_back(answer.error_m);
  }
  nlohmann::json row{{"set", set.name},
                     {"is_tuning", set.is_tuning},
                     {"detector", answers.detector},
                     {"verifier", answers.verifier},
                     {"queries", score.queries},
                     {"queries_without_match", score.queries_without_match},
                     {"recall_at_1", score.recall_at_1},
                     {"max_f1", score.max_f1},
                     {"recall_zero_wrong", score.recall_zero_wrong},
                     {"recall_accepted", score.recall_accepted},
                     {"wrong_accepted", score.wrong_accepted},
                     {"wrong_poses_accepted", score.wrong_poses_accepted},
                     {"error_m_p50", tools::quantile(error_m, 0.5)},
                     {"ms_p50", tools::quantile(ms, 0.5)},
                     {"ms_p99", tools::quantile(ms, 0.99)},
                     {"bytes_per_frame", answers.bytes_per_frame}};
  if (std::isfinite(threshold)) row["threshold"] = threshold;
  if (score.queries_without_match > 0)
    row["wrong_bound_95_pct"] = 300.0 / static_cast<double>(score.queries_without_match);
  return row;
}

/// Recall and precision of a row, for the plot.
nlohmann::json curve_of(const NamedSet& set, const Answers& answers) {
  return {{"set", set.name},
          {"detector", answers.detector},
          {"verifier", answers.verifier},
          {"curve", score_of(answers.answers, 0.0).curve}};
}

void print_heading() {
  fmt::print(
      "{:<15} {:<19} {:<20} {:>5} {:>5} {:>6} {:>6} {:>6} {:>6} {:>5} {:>5} {:>8} {:>8} {:>7}\n",
      "set", "detector", "verifier", "match", "none", "r@1", "F1", "r@0", "acc.", "wrong", "poses",
      "p50 ms", "p99 ms", "B/frame");
}

void print_row(const nlohmann::json& row) {
  const auto x = [&](const char* key) { return row[key].get<double>(); };
  const auto s = [&](const char* key) { return row[key].get<std::string>(); };
  fmt::print(
      "{:<15} {:<19} {:<20} {:>5.0f} {:>5.0f} {:>6.3f} {:>6.3f} {:>6.3f} {:>6.3f} {:>5.0f} "
      "{:>5.0f} {:>8.2f} {:>8.2f} {:>7.0f}\n",
      s("set"), s("detector"), s("verifier"), x("queries"), x("queries_without_match"),
      x("recall_at_1"), x("max_f1"), x("recall_zero_wrong"), x("recall_accepted"),
      x("wrong_accepted"), x("wrong_poses_accepted"), x("ms_p50"), x("ms_p99"),
      x("bytes_per_frame"));
  std::fflush(stdout);
}

/// The answers of all drives of a set, one after another.
std::vector<Answers> answers_of(const NamedSet& named, const fs::path& path,
                                const LoopOptions& options, const std::atomic<bool>& stop) {
  std::vector<Answers> all;
  for (std::uint64_t drive = 0; drive < (named.repeats ? options.drives : 1); ++drive) {
    SetOptions set = options.set;
    set.seed += drive + (named.is_tuning ? kTuningSeed : 0);
    set.jobs = options.trial.jobs;
    auto results = run_trials(named.make(set, path, stop), options.detectors, options.verifiers,
                              options.trial, stop);
    if (all.empty()) {
      all = std::move(results);
      continue;
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i].answers.insert(all[i].answers.end(), results[i].answers.begin(),
                            results[i].answers.end());
  }
  return all;
}

/// Rows of one set; where it is for tuning, thresholds rise to its wrong answers.
void run_set(const NamedSet& named, const fs::path& path, const LoopOptions& options,
             const std::atomic<bool>& stop, Thresholds& thresholds, nlohmann::json& rows,
             nlohmann::json& curves) {
  for (const Answers& answers : answers_of(named, path, options, stop)) {
    double& threshold = thresholds
                            .try_emplace({answers.detector, answers.verifier},
                                         -std::numeric_limits<double>::infinity())
                            .first->second;
    if (named.is_tuning) threshold = std::max(threshold, highest_wrong_score(answers.answers));
    if (options.threshold) threshold = *options.threshold;
    rows.push_back(row_of(named, answers, threshold));
    curves.push_back(curve_of(named, answers));
    print_row(rows.back());
  }
}

nlohmann::json config_of(const LoopOptions& options) {
  return {{"seed", options.set.seed},
          {"length_m", options.set.length_m},
          {"cloud_points", options.set.cloud_points},
          {"radius_m", options.trial.radius_m},
          {"frames_earlier", options.trial.frames_earlier},
          {"most_queries", options.trial.most_queries},
          {"most_cloud_queries", options.trial.most_cloud_queries},
          {"drives", options.drives},
          {"candidates", options.trial.candidates}};
}

void write_results(const LoopOptions& options, const nlohmann::json& rows,
                   const nlohmann::json& curves) {
  harness::write_json(options.json,
                      harness::result_document("loop-detectors", config_of(options), rows));
  harness::write_json(harness::traces_file(options.json), curves);
}

void run_loop_detectors(const LoopOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json curves = nlohmann::json::array();
  Thresholds thresholds;
  print_heading();
  for (const NamedSet& named : all_sets()) {
    const bool is_wanted =
        options.sets.empty() ||
        std::find(options.sets.begin(), options.sets.end(), named.name) != options.sets.end();
    if (!is_wanted) continue;
    const fs::path path = data_folder(options) / named.recorded;
    if (named.recorded[0] != '\0' && !fs::exists(path)) {
      fmt::print("{:<15} skipped: there is no {}\n", named.name, path.string());
      continue;
    }
    run_set(named, path, options, stop, thresholds, rows, curves);
    // After each set: what is done is not lost.
    if (!options.json.empty()) write_results(options, rows, curves);
  }
  fmt::print(
      "match: queries with a frame within {:.0f} m, {} frames or more earlier; none: all others. "
      "acc.: right answers above the highest score of a wrong one in the tuning sets; wrong: wrong "
      "frames above it; poses: right frames above it whose pose is off by more than {:.0f} m or "
      "{:.1f} rad.\n",
      options.trial.radius_m, options.trial.frames_earlier, options.trial.pose_m,
      options.trial.pose_rad);

  if (!options.json.empty() && options.plots)
    harness::plot("loop_detectors.py", {options.json, harness::traces_file(options.json).string()});
}

}  // namespace

void add_loop_detectors_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "loop-detectors",
      "Loop detectors and verifiers of the thesis on submaps, on the same queries");
  const auto options = std::make_shared<LoopOptions>();
  std::vector<std::string> names;
  names.reserve(all_sets().size());
  for (const NamedSet& set : all_sets()) names.emplace_back(set.name);
  command.add_option("--set", options->sets, "Sets; default all, those for tuning first")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  command.add_option("--detector", options->detectors, "Detectors")
      ->delimiter(',')
      ->check(CLI::IsMember(places::detector_names()))
      ->capture_default_str();
  command.add_option("--verifier", options->verifiers, "Verifiers")
      ->delimiter(',')
      ->check(CLI::IsMember(places::verifier_names()))
      ->capture_default_str();
  command.add_flag(
      "--detectors-only", [options](std::int64_t) { options->verifiers.clear(); }, "No verifier");
  add_number(command, "--queries", options->trial.most_queries, 1, 100000, "Most queries of a set");
  add_number(command, "--cloud-queries", options->trial.most_cloud_queries, 1, 100000,
             "Most queries of a set with point clouds");
  add_number(command, "--drives", options->drives, 1, 1000,
             "Drives through each stem map, by seed");
  command.add_option("--threshold", options->threshold,
                     "Least score that is accepted, instead of the tuned one");
  add_number(command, "--candidates", options->trial.candidates, 1, 50,
             "Candidates of a detector that are verified");
  add_number(command, "--length-m", options->set.length_m, 200.0, 100000.0,
             "Length of simulated paths [m]");
  command
      .add_option("--cloud-points", options->set.cloud_points,
                  "place_scan.most_points of simulated sweeps")
      ->check(CLI::Range(10, static_cast<int>(model::PlaceScan::kMostPoints)))
      ->capture_default_str();
  command.add_option("--seed", options->set.seed, "Seed of worlds, paths and detections")
      ->capture_default_str();
  add_number(command, "--jobs", options->trial.jobs, 1, 256, "Queries side by side");
  command.add_option("--data", options->data,
                     "Folder of recordings; default $UNDERSTORY_DATA, else ../shared/data");
  command.add_option("--json", options->json, "Result document; the plots go beside it");
  command.add_flag("!--no-plots", options->plots, "No plots");
  command.callback(
      [options] { run_guarded("loop-detectors", [&] { run_loop_detectors(*options); }); });
}

}  // namespace understory::eval::experiments::loop_detectors
