// `understory eval few-landmarks`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/few_landmarks/few_landmarks_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::few_landmarks {
namespace {

struct FewLandmarksOptions {
  int seeds = 20;
  std::uint64_t first_seed = 1;
  FewLandmarksDrive drive;
  std::string logs;
  int jobs = 1;
  std::string json;
};

nlohmann::json to_json(const LiveErrors& errors) {
  return {{"poses", errors.poses},
          {"ate_m", errors.ate_m},
          {"largest_m", errors.largest_m},
          {"nees", errors.mean_nees}};
}

nlohmann::json to_json(std::uint64_t seed, const FewLandmarksScore& score) {
  return {{"seed", seed},
          {"scans", score.scans},
          {"landmarks", score.landmarks},
          {"updates", score.updates},
          {"accepted", score.accepted},
          {"wrong", score.wrong},
          {"maps", score.maps},
          {"coasting", score.coasting},
          {"slam", to_json(score.slam)},
          {"ekf", to_json(score.ekf)},
          {"odometry_ate_m", score.odometry_ate_m},
          {"updates_ate_m", score.updates_ate_m},
          {"keyframes_ate_m", score.keyframes_ate_m}};
}

void print(const std::string& name, const FewLandmarksScore& score) {
  fmt::print(
      "{:>5} {:>6} {:>9.1f} {:>5}/{:<5} {:>5} {:>4} {:>8} | {:>5} {:>7.3f} {:>7.3f} {:>7.1f} | "
      "{:>7.3f} {:>7.1f} | {:>8.3f} {:>9.3f} {:>9.3f}\n",
      name, score.scans, score.landmarks, score.accepted, score.updates, score.wrong, score.maps,
      score.coasting, score.slam.poses, score.slam.ate_m, score.slam.largest_m,
      score.slam.mean_nees, score.ekf.ate_m, score.ekf.mean_nees, score.odometry_ate_m,
      score.updates_ate_m, score.keyframes_ate_m);
}

/// Geometric mean of one figure over the drives.
template <class Figure>
double geometric_mean(const std::vector<FewLandmarksScore>& scores, const Figure& figure) {
  double sum = 0.0;
  for (const FewLandmarksScore& score : scores) sum += std::log(std::max(figure(score), 1e-6));
  return std::exp(sum / static_cast<double>(scores.size()));
}

void print_table(const FewLandmarksOptions& options, const std::vector<FewLandmarksScore>& scores) {
  fmt::print(
      "{:>5} {:>6} {:>9} {:>11} {:>5} {:>4} {:>8} | {:>5} {:>7} {:>7} {:>7} | {:>7} {:>7} | "
      "{:>8} {:>9} {:>9}\n",
      "seed", "scans", "landmarks", "keyframes", "wrong", "maps", "coasting", "SLAM", "ATE m",
      "largest", "NEES", "EKF m", "NEES", "odometry", "keyframes", "map's end");
  for (std::size_t i = 0; i < scores.size(); ++i)
    print(fmt::format("{}", options.first_seed + i), scores[i]);
  fmt::print(
      "geometric mean of ATE: SLAM_POSE {:.3f} m, EKF_POSE {:.3f} m, odometry {:.3f} m, "
      "keyframes as they came {:.3f} m, at the end {:.3f} m\n",
      geometric_mean(scores, [](const auto& one) { return one.slam.ate_m; }),
      geometric_mean(scores, [](const auto& one) { return one.ekf.ate_m; }),
      geometric_mean(scores, [](const auto& one) { return one.odometry_ate_m; }),
      geometric_mean(scores, [](const auto& one) { return one.updates_ate_m; }),
      geometric_mean(scores, [](const auto& one) { return one.keyframes_ate_m; }));
}

void run(const FewLandmarksOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  std::vector<FewLandmarksScore> scores(static_cast<std::size_t>(options.seeds));
  tools::run_in_parallel(scores.size(), options.jobs, "drives", stop, [&](std::size_t i) {
    FewLandmarksDrive plan = options.drive;
    const std::uint64_t seed = options.first_seed + i;
    if (!options.logs.empty())
      plan.log = std::filesystem::path(options.logs) / fmt::format("few-landmarks-{}.lcm", seed);
    scores[i] = drive(plan, seed, [&](double) {
      if (stop) throw terminal::Interrupted();
    });
  });

  print_table(options, scores);
  if (options.json.empty()) return;
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 0; i < scores.size(); ++i)
    rows.push_back(to_json(options.first_seed + i, scores[i]));
  const FewLandmarksDrive& plan = options.drive;
  const nlohmann::json config = {{"seeds", options.seeds},
                                 {"first_seed", options.first_seed},
                                 {"spacing_m", plan.spacing_m},
                                 {"length_m", plan.length_m},
                                 {"laps", plan.laps},
                                 {"speed_mps", plan.speed_mps},
                                 {"rate_hz", plan.rate_hz},
                                 {"walkers", plan.walkers},
                                 {"wheel_scale", plan.wheel_scale},
                                 {"config", plan.config_dir.string()}};
  harness::write_json(options.json, harness::result_document("few-landmarks", config, rows));
}

}  // namespace

void add_few_landmarks_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "few-landmarks",
      "A car park with two or three landmarks in a scan, wheels and a one-plane laser");
  const auto options = std::make_shared<FewLandmarksOptions>();
  add_number(command, "--seeds", options->seeds, 1, 1000, "Drives");
  command.add_option("--first-seed", options->first_seed, "First seed; the others follow it")
      ->capture_default_str();

  FewLandmarksDrive& plan = options->drive;
  add_number(command, "--spacing-m", plan.spacing_m, 3.0, 100.0,
             "Distance of neighbouring trunks [m]");
  add_number(command, "--length-m", plan.length_m, 50.0, 10000.0, "Length of the circle [m]");
  add_number(command, "--laps", plan.laps, 1, 100, "Laps");
  add_number(command, "--walkers", plan.walkers, 0, 1000, "People beside the path");
  add_number(command, "--wheel-scale", plan.wheel_scale, 0.0, 20.0,
             "Errors of wheels and steering, as a multiple of the simulation's defaults");

  command.add_option("--config", plan.config_dir, "Configuration of the chain's services")
      ->capture_default_str();
  command.add_option("--logs", options->logs, "Folder for the readings of each drive, as logs");
  add_number(command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("few-landmarks", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::few_landmarks
