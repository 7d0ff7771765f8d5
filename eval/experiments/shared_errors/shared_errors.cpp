#include "eval/experiments/shared_errors/shared_errors.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "common/geometry/trajectory_error.hpp"
#include "common/io/stem_frames.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/loops/loop_batch.hpp"
#include "eval/experiments/loops/loop_drive.hpp"
#include "eval/experiments/loops/loop_run.hpp"
#include "eval/experiments/loops/loops_command.hpp"
#include "eval/experiments/shared_errors/surveyed_drives.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::shared_errors {
namespace {

/// Of a walk that was recorded; simulated ones have the name of their errors.
constexpr const char* kRecorded = "recorded";

struct SharedErrorsOptions {
  std::vector<std::string> drives;
  std::vector<std::string> errors{"shared"};
  std::vector<std::string> recorded;  ///< Folders of frames.
  std::string data;
  std::string config = "deploy/config/stem_frames";
  loops::LoopDriveOptions inputs;
  int runs = 20;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;
};

SurveyedDrive drive_named(const std::string& name) {
  const std::vector<SurveyedDrive> all = surveyed_drives();
  const auto found = std::ranges::find(all, name, &SurveyedDrive::name);
  if (found == all.end()) throw std::runtime_error(fmt::format("--drive {}: no such drive", name));
  return *found;
}

/// Whether the mean NEES of a drive is where it is in 95 % of drives in which one error moves all
/// keyframes.
bool is_in_band(double nees) {
  return nees >= geometry::kNeesBandLow && nees <= geometry::kNeesBandHigh;
}

nlohmann::json row_of(const loops::LoopDrive& drive, const loops::LoopScore& score,
                      const loops::PathErrors& batch) {
  const loops::DriveFate& fate = score.fate;
  return {{"frames", drive.scans.size()},
          {"length_m", drive.length_m},
          {"odometry_end_m", drive.closing_error_m},
          {"keyframes", score.keyframes},
          {"maps", score.maps},
          {"in_map", score.in_map},
          {"ate_m", score.ate_m},
          {"ate_batch_m", batch.ate_m},
          {"ate_live_m", fate.live_ate_m},
          {"live_poses", fate.live_poses},
          {"nees", fate.nees},
          {"nees_within_95_pct", fate.within_95_pct},
          {"nees_in_band", is_in_band(fate.nees)},
          {"closures_sent", score.sent},
          {"closures_right", score.sent - score.sent_wrong},
          {"closures_accepted", score.accepted},
          {"closures_accepted_wrong", score.accepted_wrong},
          {"closures_not_accepted", fate.not_accepted},
          {"rolled_back", fate.rolled_back},
          {"without_pose", fate.without_pose},
          {"trees", fate.trees},
          {"doubled_pct", fate.trees == 0 ? 0.0
                                          : 100.0 * static_cast<double>(fate.doubled) /
                                                static_cast<double>(fate.trees)},
          {"frame_ms_first_quarter", fate.first_quarter_ms},
          {"frame_ms_last_quarter", fate.last_quarter_ms}};
}

/// Frames of one draw of a drive.
using FramesOf = std::function<std::vector<model::StemFrame>(std::uint64_t seed)>;

nlohmann::json run_one(const std::string& name, const std::string& errors,
                       const std::vector<model::StemFrame>& frames,
                       const loops::LoopDriveOptions& inputs, const std::string& config,
                       std::uint64_t seed) {
  const loops::LoopDrive drive = loops::loop_drive(name, frames, inputs, seed);
  const loops::LoopScore score = loops::run_drive(drive, config, true);
  nlohmann::json row =
      row_of(drive, score, batch_errors(drive, score.first_frame, loops::Association::kTrue));
  row["drive"] = name;
  row["errors"] = errors;
  row["run_seed"] = seed;
  return row;
}

void print_heading() {
  fmt::print(
      "{:<17} {:<11} {:>4} {:>7} {:>7} {:>6} {:>7} {:>7} {:>6} {:>5} {:>20} {:>6} {:>6} {:>5} "
      "{:>7} {:>6} {:>6}\n",
      "drive", "errors", "runs", "ATE m", "batch", "ratio", "live m", "NEES", "band %", "<95%",
      "sent/right/acc/wrong", "rolled", "nopose", "maps", "doubled", "ms 1st", "last");
}

/// One line for the runs of a drive: means, but sums of closures and keyframes.
void print_runs(const std::vector<nlohmann::json>& rows) {
  const auto sum = [&](const char* key) {
    double total = 0.0;
    for (const nlohmann::json& row : rows) total += row[key].get<double>();
    return total;
  };
  const auto mean = [&](const char* key) { return sum(key) / static_cast<double>(rows.size()); };

  const auto in_band = std::ranges::count_if(
      rows, [](const auto& row) { return row["nees_in_band"].template get<bool>(); });
  fmt::print(
      "{:<17} {:<11} {:>4} {:>7.4f} {:>7.4f} {:>6.2f} {:>7.3f} {:>7.2f} {:>6.0f} {:>5.0f} "
      "{:>20} {:>6.0f} {:>6.0f} {:>5.1f} {:>6.2f}% {:>6.2f} {:>6.2f}\n",
      rows.front()["drive"].get<std::string>(), rows.front()["errors"].get<std::string>(),
      rows.size(), mean("ate_m"), mean("ate_batch_m"), mean("ate_m") / mean("ate_batch_m"),
      mean("ate_live_m"), mean("nees"),
      100.0 * static_cast<double>(in_band) / static_cast<double>(rows.size()),
      mean("nees_within_95_pct"),
      fmt::format("{:.0f}/{:.0f}/{:.0f}/{:.0f}", sum("closures_sent"), sum("closures_right"),
                  sum("closures_accepted"), sum("closures_accepted_wrong")),
      sum("rolled_back"), sum("without_pose"), mean("maps"), mean("doubled_pct"),
      mean("frame_ms_first_quarter"), mean("frame_ms_last_quarter"));
  std::fflush(stdout);
}

void print_reasons(const nlohmann::json& rows) {
  std::map<std::string, std::size_t> reasons;
  for (const nlohmann::json& row : rows)
    for (const auto& [reason, count] : row["closures_not_accepted"].items())
      reasons[reason] += count.get<std::size_t>();
  for (const auto& [reason, count] : reasons)
    fmt::print("{} closures not accepted at once: {}\n", count, reason);
}

/// All draws of a drive, printed as one line and put behind `rows`.
void run_draws(const std::string& name, const std::string& errors, const FramesOf& frames_of,
               const loops::LoopDriveOptions& inputs, const SharedErrorsOptions& options,
               const std::atomic<bool>& stop, nlohmann::json& rows) {
  std::vector<nlohmann::json> of_drive(static_cast<std::size_t>(options.runs));
  tools::run_in_parallel(of_drive.size(), options.jobs, name, stop, [&](std::size_t i) {
    const std::uint64_t seed = harness::run_seed(options.seed, static_cast<int>(i));
    of_drive[i] = run_one(name, errors, frames_of(seed), inputs, options.config, seed);
  });
  print_runs(of_drive);
  for (nlohmann::json& row : of_drive) rows.push_back(std::move(row));
}

void run_simulated(const std::string& name, const SharedErrorsOptions& options,
                   const std::atomic<bool>& stop, nlohmann::json& rows) {
  const SurveyedDrive surveyed = drive_named(name);
  const Survey survey = read_survey(surveyed, options.data);
  loops::LoopDriveOptions inputs = options.inputs;
  inputs.view_rad = surveyed.drive.detector.view_rad;
  inputs.truth_sigma = {};  // exact
  for (const std::string& errors : options.errors) {
    const auto frames_of = [&](std::uint64_t seed) {
      return drive_frames(surveyed, survey, stem_errors(errors).value(), seed);
    };
    run_draws(name, errors, frames_of, inputs, options, stop, rows);
  }
}

/// The frames are as they are; the seeds draw the odometry.
void run_recorded(const std::string& folder, const SharedErrorsOptions& options,
                  const std::atomic<bool>& stop, nlohmann::json& rows) {
  const std::vector<model::StemFrame> frames = io::read_stem_frames(folder);
  run_draws(
      loops::name_of(folder), kRecorded, [&](std::uint64_t) { return frames; }, options.inputs,
      options, stop, rows);
}

void run_shared_errors(const SharedErrorsOptions& options) {
  if (options.data.empty() && !options.drives.empty())
    throw std::runtime_error("--data: the simulated drives need the folder of surveyed maps");

  const auto& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  print_heading();
  for (const std::string& name : options.drives) run_simulated(name, options, stop, rows);
  for (const std::string& folder : options.recorded) run_recorded(folder, options, stop, rows);
  print_reasons(rows);
  if (options.json.empty()) return;

  const nlohmann::json config{{"seed", options.seed},
                              {"runs", options.runs},
                              {"config", options.config},
                              {"recorded", options.recorded},
                              {"truth_sigma_m", options.inputs.truth_sigma.position_m},
                              {"truth_sigma_rad", options.inputs.truth_sigma.heading_rad}};
  harness::write_json(options.json, harness::result_document("shared-errors", config, rows));
}

}  // namespace

void add_shared_errors_experiment(CLI::App& eval) {
  CLI::App& command =
      *eval.add_subcommand("shared-errors",
                           "Drives whose detections share errors from frame to frame: error, "
                           "consistency, closures and time beside the batch solution");
  const auto options = std::make_shared<SharedErrorsOptions>();
  command.add_option("--data", options->data, "Folder of recordings, with the surveyed maps");
  command
      .add_option("--drive", options->drives,
                  "Simulated drives; default: six, or none with --recorded. A seventh is "
                  "longleaf-few, with two or three stems per frame")
      ->delimiter(',');

  command
      .add_option("--recorded", options->recorded,
                  "Folders of recorded frames (frame_<n>.csv, trajectory.txt); runs draw the "
                  "odometry")
      ->check(CLI::ExistingDirectory);
  add_number(command, "--truth-sigma-m", options->inputs.truth_sigma.position_m, 0.0, 100.0,
             "Standard deviation of recorded true positions, per axis; for NEES");
  const auto truth_sigma_deg = std::make_shared<double>(0.0);
  command
      .add_option("--truth-sigma-deg", *truth_sigma_deg,
                  "Standard deviation of recorded true headings; for NEES")
      ->check(CLI::Range(0.0, 90.0));

  command
      .add_option("--errors", options->errors,
                  "shared: as measured; along, direction, range: only this part; independent: "
                  "none. White noise has the power of the parts left out")
      ->delimiter(',')
      ->check(CLI::IsMember({"shared", "along", "direction", "range", "independent"}));

  command.add_option("--config", options->config, "Configuration folder of the stages")
      ->capture_default_str();
  add_number(command, "--runs", options->runs, 1, 10000, "Drives through each map");
  command.add_option("--seed", options->seed, "Seed of paths, errors and odometry")
      ->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Runs side by side");
  command.add_option("--json", options->json, "Result document");

  command.callback([options, truth_sigma_deg] {
    options->inputs.truth_sigma.heading_rad = *truth_sigma_deg * std::numbers::pi / 180.0;
    if (options->drives.empty() && options->recorded.empty())
      options->drives.assign(usual_drives().begin(), usual_drives().end());
    run_guarded("shared-errors", [options] { run_shared_errors(*options); });
  });
}

}  // namespace understory::eval::experiments::shared_errors
