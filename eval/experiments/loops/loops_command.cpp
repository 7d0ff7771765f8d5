#include "eval/experiments/loops/loops_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/io/stem_frames.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/loops/loop_batch.hpp"
#include "eval/experiments/loops/loop_drive.hpp"
#include "eval/experiments/loops/loop_run.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::loops {
namespace {

struct LoopsOptions {
  std::vector<std::string> drives;
  std::string config = "deploy/config/stem_frames";
  LoopDriveOptions drive;
  std::string blind;
  int runs = 1;
  std::uint64_t seed = 1;
  int jobs = 1;
  bool reckon = false;
  std::string json;
};

/// FROM-TO, shares of the drive.
void parse_blind(const std::string& text, LoopDriveOptions& drive) {
  if (text.empty()) return;
  if (std::sscanf(text.c_str(), "%lf-%lf", &drive.blind_from, &drive.blind_to) != 2 ||
      !(0.0 <= drive.blind_from && drive.blind_from < drive.blind_to && drive.blind_to <= 1.0))
    throw std::runtime_error(fmt::format(
        "--blind {}: two shares of the drive, FROM-TO, 0 <= FROM < TO <= 1, are wanted", text));
}

nlohmann::json path_json(const LoopScore& score) {
  return {{"keyframes", score.keyframes}, {"placed", score.placed},   {"maps", score.maps},
          {"in_map", score.in_map},       {"error_m", score.error_m}, {"ate_m", score.ate_m}};
}

nlohmann::json closures_json(const LoopScore& score) {
  return {{"queries", score.queries},
          {"queries_with_match", score.with_match},
          {"queries_without_match", score.without_match},
          {"sent", score.sent},
          {"sent_unexpected", score.unexpected},
          {"sent_wrong", score.sent_wrong},
          {"accepted", score.accepted},
          {"wrong_accepted", score.accepted_wrong},
          {"waiting", score.waiting},
          {"refused", score.refused},
          {"mean_nees", score.mean_nees}};
}

nlohmann::json times_json(const LoopScore& score) {
  return {{"search_ms_p50", score.search_ms_p50},
          {"search_ms_p99", score.search_ms_p99},
          {"mapper_ms_p99", score.mapper_ms_p99},
          {"largest_closure_ms", score.largest_closure_ms}};
}

nlohmann::json row_of(const LoopDrive& drive, std::uint64_t seed, const LoopScore& score) {
  nlohmann::json row{{"drive", drive.name},
                     {"run_seed", seed},
                     {"frames", drive.scans.size()},
                     {"length_m", drive.length_m},
                     {"odometry_end_m", drive.closing_error_m}};
  row.update(path_json(score));
  row.update(closures_json(score));
  row.update(times_json(score));
  return row;
}

/// The solutions of one drive.
nlohmann::json solve(const std::string& name, const std::vector<model::StemFrame>& frames,
                     const LoopsOptions& options, std::uint64_t seed) {
  const LoopDrive drive = loop_drive(name, frames, options.drive, seed);
  if (options.reckon) return row_of(drive, seed, reckon_drive(drive, options.config));
  const LoopScore score = run_drive(drive, options.config, true);
  nlohmann::json row = row_of(drive, seed, score);
  row["error_without_m"] = run_drive(drive, options.config, false).error_m;
  const PathErrors batch = batch_errors(drive, score.first_frame, Association::kTrue);
  row["error_batch_m"] = batch.mean_m;
  row["ate_batch_m"] = batch.ate_m;
  const PathErrors known = batch_errors(drive, score.first_frame, Association::kRecognisable);
  row["error_recognisable_m"] = known.mean_m;
  row["ate_recognisable_m"] = known.ate_m;
  return row;
}

void print_heading() {
  fmt::print(
      "{:<22} {:>6} {:>5} {:>4} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7} {:>11} {:>14} "
      "{:>13} {:>6} {:>11} {:>8}\n",
      "drive", "m", "maps", "in", "odo m", "without", "error m", "recogn.", "batch", "ATE m",
      "ATE rec", "ATE bat", "queries/none", "sent/unx/wrong", "acc./wait/ref", "wrong",
      "ms p50/p99", "mapper");
}

void print_row(const nlohmann::json& row) {
  const auto n = [&](const char* key) { return row.value(key, std::size_t{0}); };
  const auto x = [&](const char* key) { return row.value(key, 0.0); };
  fmt::print(
      "{:<22} {:>6.0f} {:>5} {:>4} {:>8.2f} {:>8.3f} {:>8.3f} {:>7.3f} {:>7.3f} {:>7.3f} {:>7.3f} "
      "{:>7.3f} {:>6}/{:<5} {:>6}/{:>3}/{:<3} "
      "{:>5}/{:>3}/{:<3} {:>6} {:>5.0f}/{:<5.0f} {:>4.0f}/{:<4.0f}\n",
      row["drive"].get<std::string>(), x("length_m"), n("maps"), n("in_map"), x("odometry_end_m"),
      x("error_without_m"), x("error_m"), x("error_recognisable_m"), x("error_batch_m"), x("ate_m"),
      x("ate_recognisable_m"), x("ate_batch_m"), n("queries"), n("queries_without_match"),
      n("sent"), n("sent_unexpected"), n("sent_wrong"), n("accepted"), n("waiting"), n("refused"),
      n("wrong_accepted"), x("search_ms_p50"), x("search_ms_p99"), x("mapper_ms_p99"),
      x("largest_closure_ms"));
  std::fflush(stdout);
}

void print_sum(const nlohmann::json& rows) {
  std::size_t none = 0, sent = 0, sent_wrong = 0, accepted = 0, wrong = 0;
  for (const nlohmann::json& row : rows) {
    none += row["queries_without_match"].get<std::size_t>();
    sent += row["sent"].get<std::size_t>();
    sent_wrong += row["sent_wrong"].get<std::size_t>();
    accepted += row["accepted"].get<std::size_t>();
    wrong += row["wrong_accepted"].get<std::size_t>();
  }
  fmt::print("{} closures sent, {} wrong; {} accepted, {} wrong; {} queries without a true match",
             sent, sent_wrong, accepted, wrong, none);
  if (none > 0 && sent_wrong == 0)
    fmt::print(" (95 % bound {:.1e})", 3.0 / static_cast<double>(none));
  fmt::print("\n");
}

void run_loops(LoopsOptions options) {
  const auto& stop = terminal::catch_interrupts();
  parse_blind(options.blind, options.drive);
  nlohmann::json rows = nlohmann::json::array();
  print_heading();
  for (const std::string& folder : options.drives) {
    const std::vector<model::StemFrame> frames = io::read_stem_frames(folder);
    const std::string name = name_of(folder);
    std::vector<nlohmann::json> of_drive(static_cast<std::size_t>(options.runs));
    tools::run_in_parallel(of_drive.size(), options.jobs, name, stop, [&](std::size_t i) {
      const std::uint64_t seed = harness::run_seed(options.seed, static_cast<int>(i));
      of_drive[i] = solve(name, frames, options, seed);
    });
    for (nlohmann::json& row : of_drive) {
      print_row(row);
      rows.push_back(std::move(row));
    }
  }
  print_sum(rows);
  if (options.json.empty()) return;

  const nlohmann::json config{{"seed", options.seed},
                              {"runs", options.runs},
                              {"blind", options.blind},
                              {"reckon", options.reckon}};
  harness::write_json(options.json, harness::result_document("loops", config, rows));
}

void add_run_options(CLI::App& command, LoopsOptions& options) {
  add_number(command, "--runs", options.runs, 1, 10000, "Draws of the odometry for each drive");
  command.add_option("--seed", options.seed, "Seed of the odometry")->capture_default_str();
  add_number(command, "--jobs", options.jobs, 1, 256, "Runs side by side");
}

}  // namespace

std::string name_of(const std::string& folder) {
  std::filesystem::path path(folder);
  if (path.filename().empty()) path = path.parent_path();
  return path.filename().string();
}

void add_loops_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "loops",
      "Drives of stem frames with loops: those found while tracking, beside the batch solution");
  const auto options = std::make_shared<LoopsOptions>();
  command
      .add_option("drives", options->drives,
                  "Folders with frame_<n>.csv and trajectory.txt, as sim stem-frames makes them")
      ->required();
  command.add_option("--config", options->config, "Configuration folder of the stages")
      ->capture_default_str();
  command.add_option("--blind", options->blind,
                     "Share of the drive on which no stem is seen, FROM-TO");
  add_run_options(command, *options);
  command.add_flag("--reckon", options->reckon,
                   "Only the loop closer, with a mapper that only dead-reckons by odometry");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("loops", [options] { run_loops(*options); }); });
}

}  // namespace understory::eval::experiments::loops
