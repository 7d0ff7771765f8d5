// `understory eval gaps`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/gaps/gap_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::gaps {
namespace {

struct GapsOptions {
  int seeds = 5;
  std::uint64_t first_seed = 1;
  std::string lidar = "vlp16";
  std::string only;
  GapDrive drive;
  int jobs = 1;
  std::string json;
};

std::vector<Gap> gaps_with(const std::string& only) {
  std::vector<Gap> gaps = all_gaps();
  if (only.empty()) return gaps;
  std::erase_if(gaps, [&](const Gap& gap) {
    return gap.seconds > 0.0 && gap.what.find(only) == std::string::npos;
  });
  if (gaps.size() < 2) throw std::invalid_argument("--only: no gap has this in its name");
  return gaps;
}

nlohmann::json to_json(const PosesAroundGap& poses) {
  return {{"goes_on", poses.goes_on},
          {"waited_s", poses.waited_s},
          {"announced", poses.is_announced},
          {"new_map", poses.is_new_map},
          {"step_m", poses.step_m},
          {"nees", poses.nees ? nlohmann::json(*poses.nees) : nlohmann::json()},
          {"rms_m", poses.rms_m}};
}

void print(const Gap& gap, std::uint64_t seed, const GapScore& score) {
  const auto of = [](const PosesAroundGap& poses) {
    return fmt::format("{:<5} {:>6.2f} s {:>7.3f} m {:>8} {:>9} {:>7.1f} mm",
                       poses.goes_on ? "on" : "ends", poses.waited_s, poses.step_m,
                       poses.nees      ? fmt::format("{:.1f}", *poses.nees)
                       : poses.goes_on ? "new map"
                                       : "-",
                       poses.is_announced ? "announced" : "", 1e3 * poses.rms_m);
  };
  fmt::print("{:<14} {:>4.1f} s {:>5} | {} | {}\n", gap.what, gap.seconds, seed, of(score.ekf),
             of(score.slam));
  std::fflush(stdout);
}

void run(GapsOptions options) {
  options.drive.is_vlp16 = options.lidar == "vlp16";
  const std::vector<Gap> gaps = gaps_with(options.only);
  const auto seeds = static_cast<std::size_t>(options.seeds);
  const auto seed_of = [&](std::size_t i) { return options.first_seed + i % seeds; };
  std::vector<GapScore> scores(gaps.size() * seeds);
  tools::run_in_parallel(
      scores.size(), options.jobs, "gaps", terminal::catch_interrupts(),
      [&](std::size_t i) { scores[i] = drive(options.drive, gaps[i / seeds], seed_of(i)); });

  fmt::print("{:<27} | {:<52} | {}\n", "gap, seed", "EKF_POSE: waited, step, NEES, RMS",
             "SLAM_POSE");
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const Gap& gap = gaps[i / seeds];
    print(gap, seed_of(i), scores[i]);
    rows.push_back({{"what", gap.what},
                    {"seconds", gap.seconds},
                    {"seed", seed_of(i)},
                    {"ekf", to_json(scores[i].ekf)},
                    {"slam", to_json(scores[i].slam)}});
  }
  if (options.json.empty()) return;
  const nlohmann::json config = {{"seed", options.first_seed},
                                 {"seeds", options.seeds},
                                 {"length_m", options.drive.length_m},
                                 {"lidar", options.lidar},
                                 {"config", options.drive.config_dir.string()}};
  harness::write_json(options.json, harness::result_document("gaps", config, rows));
}

}  // namespace

void add_gaps_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "gaps",
      "A process that hangs or a sensor that is silent for 1.1 to 30 s: the poses after it");
  const auto options = std::make_shared<GapsOptions>();
  add_number(command, "--seeds", options->seeds, 1, 1000, "Drives for each gap");
  command.add_option("--first-seed", options->first_seed, "First seed; the others follow it")
      ->capture_default_str();
  add_number(command, "--length-m", options->drive.length_m, 250.0, 100000.0,
             "Length of a drive [m]");

  command.add_option("--lidar", options->lidar, "vlp32 or vlp16")
      ->check(CLI::IsMember({"vlp32", "vlp16"}))
      ->capture_default_str();
  command.add_option("--only", options->only,
                     "Only gaps whose name contains this, and the drive without one");
  command
      .add_option("--config", options->drive.config_dir, "Configuration of the chain's services")
      ->capture_default_str();

  add_number(command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command.add_option("--json", options->json, "Result document");

  command.callback([options] { run_guarded("gaps", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::gaps
