// `understory eval landmarks-vs-error`: does seeing more landmarks make the pose better? (thesis on
// submaps, chapter 4, equation 4.1 and figures 4.4-4.9)
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/harness/chain_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::roads {
namespace {

struct Options {
  std::uint64_t seed = 1;
  int jobs = 1;
  int runs = 1;
  double length_m = 2000.0;
  bool wheels = true;
  std::string config_dir = "deploy/config/lidar";
  std::string json;
  bool plots = true;
};

/// A sweep while the vehicle moved.
struct Sample {
  int run = 0;
  double time_s = 0.0;
  std::uint32_t landmarks = 0;  ///< That the filter used.
  /// |(x[k] - x_ref[k]) - (x[k-1] - x_ref[k-1])| / 2, equation 4.1 of the thesis on submaps, in the
  /// gauge of the first pose. An error of the heading made long before goes on to count in it.
  double change_m = 0.0;
  /// Error of the motion over the last second, in the frame of its start: errors that arise now
  /// alone.
  std::optional<double> second_m;
  /// Of that second.
  double mean_landmarks = 0.0;
};

/// An estimate along a route.
struct Curve {
  std::string route;
  std::string estimate;
  std::vector<Sample> samples;
};

constexpr double kStationary_m = 0.05;  // path in a sweep below which the vehicle is stationary
constexpr std::size_t kSecond = 10;     // sweeps

struct Step {
  model::Utime utime;
  std::uint32_t landmarks;
  geometry::SE2 estimate;
  geometry::SE2 truth;
};

std::vector<Step> steps_of(const harness::ChainRun& run,
                           std::span<const metrics::StampedPose> poses) {
  std::map<model::Utime, std::uint32_t> landmarks;
  for (const model::EkfPose& pose : run.ekf) landmarks[pose.utime] = pose.landmarks_used;
  std::vector<Step> steps;
  for (const metrics::StampedPose& pose : poses) {
    const auto truth = pose_at(run.truth, pose.utime);
    const auto count = landmarks.find(pose.utime);
    if (!truth || count == landmarks.end()) continue;
    steps.push_back({pose.utime, count->second, pose.pose, *truth});
  }
  return steps;
}

std::vector<Sample> samples_of(std::span<const Step> steps, int run) {
  std::vector<Sample> samples;
  if (steps.empty()) return samples;

  const geometry::SE2 world_T_map = steps.front().truth * steps.front().estimate.inverse();
  const auto error = [&](const Step& step) {
    return Eigen::Vector2d(world_T_map * step.estimate.translation() - step.truth.translation());
  };

  for (std::size_t k = 1; k < steps.size(); ++k) {
    const Step& now = steps[k];
    const Step& before = steps[k - 1];
    const double pause_s = 1e-6 * static_cast<double>(now.utime - before.utime);
    const double way = (now.truth.translation() - before.truth.translation()).norm();
    if (pause_s > 0.15 || way < kStationary_m) continue;

    Sample sample;
    sample.run = run;
    sample.time_s = 1e-6 * static_cast<double>(now.utime);
    sample.landmarks = now.landmarks;
    sample.change_m = 0.5 * (error(now) - error(before)).norm();

    if (k >= kSecond && now.utime - steps[k - kSecond].utime < 1150000) {
      const Step& start = steps[k - kSecond];
      sample.second_m = ((start.estimate.inverse() * now.estimate).translation() -
                         (start.truth.inverse() * now.truth).translation())
                            .norm();
      for (std::size_t j = k - kSecond; j < k; ++j) {
        sample.mean_landmarks += static_cast<double>(steps[j + 1].landmarks) / kSecond;
      }
    }
    samples.push_back(sample);
  }
  return samples;
}

/// Means over the samples with so many landmarks.
struct Means {
  std::size_t sweeps = 0;
  double change_m = 0.0;
  std::size_t seconds = 0;
  double second_m = 0.0;
};

/// By number of landmarks in the sweep, and on the average of the second.
Means means_of(const std::vector<Sample>& samples, std::uint32_t first, std::uint32_t last) {
  Means means;
  for (const Sample& sample : samples) {
    if (sample.landmarks >= first && sample.landmarks <= last) {
      ++means.sweeps;
      means.change_m += sample.change_m;
    }

    const auto around = static_cast<std::uint32_t>(std::lround(sample.mean_landmarks));
    if (sample.second_m && around >= first && around <= last) {
      ++means.seconds;
      means.second_m += *sample.second_m;
    }
  }

  means.change_m /= static_cast<double>(std::max<std::size_t>(1, means.sweeps));
  means.second_m /= static_cast<double>(std::max<std::size_t>(1, means.seconds));
  return means;
}

nlohmann::json rows_of(const std::vector<Curve>& curves) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Curve& curve : curves) {
    std::uint32_t most = 0;
    for (const Sample& sample : curve.samples) most = std::max(most, sample.landmarks);

    for (std::uint32_t landmarks = 0; landmarks <= most; ++landmarks) {
      const Means means = means_of(curve.samples, landmarks, landmarks);
      if (means.sweeps + means.seconds == 0) continue;
      rows.push_back({{"route", curve.route},
                      {"estimate", curve.estimate},
                      {"landmarks", landmarks},
                      {"samples", means.sweeps},
                      {"mean_error_change_m", means.change_m},
                      {"seconds", means.seconds},
                      {"mean_error_of_a_second_m", means.second_m}});
    }
  }
  return rows;
}

void print(const std::vector<Curve>& curves) {
  constexpr std::uint32_t kBounds[] = {0, 1, 2, 3, 4, 7, 10, 16, 1000};
  std::cout << fmt::format("{:<20} {:<10} {:>9} {:>7} {:>24} {:>20}\n", "route", "estimate",
                           "landmarks", "sweeps", "change of error (4.1)", "error of a second");

  for (const Curve& curve : curves) {
    for (std::size_t b = 0; b + 1 < std::size(kBounds); ++b) {
      const std::uint32_t first = kBounds[b];
      const std::uint32_t last = kBounds[b + 1] - 1;
      const Means means = means_of(curve.samples, first, last);
      if (means.sweeps == 0) continue;

      const std::string range = first == last ? fmt::format("{}", first)
                                : last >= 999 ? fmt::format("{}..", first)
                                              : fmt::format("{}..{}", first, last);
      std::cout << fmt::format("{:<20} {:<10} {:>9} {:>7} {:>21.2f} mm {:>17.1f} mm\n", curve.route,
                               curve.estimate, range, means.sweeps, 1e3 * means.change_m,
                               1e3 * means.second_m);
    }
  }
}

nlohmann::json traces_of(const std::vector<Curve>& curves) {
  nlohmann::json traces = nlohmann::json::array();
  for (const Curve& curve : curves) {
    nlohmann::json samples = nlohmann::json::array();
    for (const Sample& sample : curve.samples) {
      samples.push_back({sample.run, sample.time_s, sample.landmarks, sample.change_m,
                         sample.second_m ? nlohmann::json(*sample.second_m) : nlohmann::json()});
    }
    traces.push_back({{"route", curve.route}, {"estimate", curve.estimate}, {"samples", samples}});
  }
  return traces;
}

/// The routes of the thesis on submaps. The first two share their path; noise and biases differ, as
/// on two days.
struct Route {
  std::string name;
  sim::Scenario (*scenario)(double length_m, std::uint64_t seed);
  double length_m;
  std::uint64_t day;
};

harness::ChainRun drive_route(const Route& route, const Options& options, std::uint64_t seed,
                              const std::atomic<bool>& stop) {
  sim::SensorSuite suite;
  if (!options.wheels) suite.wheels.reset();
  sim::SensorDrive drive(route.scenario(route.length_m, seed), sim::SpeedParameters{}, suite,
                         1000 * seed + route.day);
  harness::ChainOptions chain;
  chain.config_dir = options.config_dir;
  chain.progress = [&](double) {
    if (stop) throw std::runtime_error("interrupted");
  };
  return drive_chain(drive, chain);
}

void run(const Options& options) {
  const auto& stop = terminal::catch_interrupts();

  const std::vector<Route> routes = {
      {"City to country 1", sim::urban_to_countryside_scenario, options.length_m, 1},
      {"City to country 2", sim::urban_to_countryside_scenario, options.length_m, 2},
      {"Countryside", sim::countryside_scenario, 1.5 * options.length_m, 1},
  };

  const auto runs = static_cast<std::size_t>(options.runs);
  struct Driven {
    std::vector<Sample> ekf;
    std::vector<Sample> slam;
  };

  std::vector<Driven> driven(routes.size() * runs);
  tools::run_in_parallel(
      driven.size(), options.jobs, "landmarks-vs-error", stop, [&](std::size_t i) {
        const std::size_t run = i % runs;
        const harness::ChainRun drive =
            drive_route(routes[i / runs], options, options.seed + run, stop);
        driven[i].ekf =
            samples_of(steps_of(drive, harness::poses_of(drive.ekf)), static_cast<int>(run));
        driven[i].slam =
            samples_of(steps_of(drive, harness::poses_of(drive.slam)), static_cast<int>(run));
      });

  // A curve takes the samples of all runs of its route.
  std::vector<Curve> curves;
  for (std::size_t route = 0; route < routes.size(); ++route) {
    Curve ekf{routes[route].name, "EKF_POSE", {}};
    Curve slam{routes[route].name, "SLAM_POSE", {}};
    for (std::size_t run = 0; run < runs; ++run) {
      const Driven& one = driven[route * runs + run];
      ekf.samples.insert(ekf.samples.end(), one.ekf.begin(), one.ekf.end());
      slam.samples.insert(slam.samples.end(), one.slam.begin(), one.slam.end());
    }
    curves.push_back(std::move(ekf));
    curves.push_back(std::move(slam));
  }

  print(curves);
  if (options.json.empty()) return;

  const nlohmann::json config = {{"seed", options.seed},
                                 {"runs", options.runs},
                                 {"length_m", options.length_m},
                                 {"wheels", options.wheels}};
  harness::write_json(options.json,
                      harness::result_document("landmarks-vs-error", config, rows_of(curves)));
  harness::write_json(harness::traces_file(options.json), traces_of(curves));
  if (options.plots) {
    harness::plot("landmarks_vs_error.py",
                  {options.json, harness::traces_file(options.json).string()});
  }
}

}  // namespace

void add_landmarks_vs_error_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "landmarks-vs-error", "Change of the error against the number of landmarks in view");
  auto options = std::make_shared<Options>();
  command->add_option("--seed", options->seed, "Seed of everything");
  add_number(*command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  add_number(*command, "--runs", options->runs, 1, 1000,
             "Runs of each route, each in another world");
  command->add_flag("!--no-wheels", options->wheels, "Only an IMU, as in the thesis on submaps");
  add_number(*command, "--length-m", options->length_m, 200.0, 100000.0,
             "Length of the city routes [m]; the country route is 1.5 times as long");
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");
  command->add_option("--json", options->json, "Results; traces and plots go beside it");
  command->add_flag("!--no-plots", options->plots, "No plots");
  command->callback([options] { run_guarded("landmarks-vs-error", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::roads
