// `understory eval landmarks-vs-error`: does seeing more landmarks make the pose better? (thesis on
// submaps, chapter 4, equation 4.1 and figures 4.4-4.9)
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "eval/chain_drive.hpp"
#include "eval/experiments.hpp"
#include "eval/frontend.hpp"
#include "eval/interrupt.hpp"
#include "eval/parallel.hpp"
#include "eval/results.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval {
namespace {

struct Options {
  std::uint64_t seed = 1;
  int jobs = 1;
  double length_m = 2000.0;
  std::string config_dir = "deploy/config/lidar";
  std::string json;
  bool plots = true;
};

/// One sweep: how many landmarks the filter used, and by how much the error changed.
struct Sample {
  double time_s = 0.0;
  std::uint32_t landmarks = 0;
  double change_m = 0.0;
};

struct RouteResult {
  std::string name;
  std::vector<Sample> samples;
};

/// |(x[k] - x_ref[k]) - (x[k-1] - x_ref[k-1])| / 2 (equation 4.1), in the gauge of the first pose.
std::vector<Sample> samples_of(const ChainRun& run) {
  std::vector<Sample> samples;
  std::optional<SE2> world_T_map;
  std::optional<Eigen::Vector2d> error_before;
  for (const EkfPose& pose : run.ekf) {
    const auto truth = pose_at(run.truth, pose.utime);
    if (!truth) continue;
    if (!world_T_map) world_T_map = *truth * pose.ekf_map_T_vehicle.inverse();
    const Eigen::Vector2d error =
        *world_T_map * pose.ekf_map_T_vehicle.translation() - truth->translation();
    if (error_before) {
      samples.push_back({1e-6 * static_cast<double>(pose.utime), pose.landmarks_used,
                         0.5 * (error - *error_before).norm()});
    }
    error_before = error;
  }
  return samples;
}

nlohmann::json rows_of(const std::vector<RouteResult>& routes) {
  nlohmann::json rows = nlohmann::json::array();
  for (const RouteResult& route : routes) {
    std::map<std::uint32_t, std::pair<std::size_t, double>> by_landmarks;
    for (const Sample& sample : route.samples) {
      auto& [count, sum] = by_landmarks[sample.landmarks];
      ++count;
      sum += sample.change_m;
    }
    for (const auto& [landmarks, entry] : by_landmarks) {
      rows.push_back({{"route", route.name},
                      {"landmarks", landmarks},
                      {"samples", entry.first},
                      {"mean_error_change_m", entry.second / static_cast<double>(entry.first)}});
    }
  }
  return rows;
}

void print(const std::vector<RouteResult>& routes) {
  constexpr std::uint32_t kBounds[] = {0, 1, 4, 7, 13, 25, 1000};
  std::cout << fmt::format("{:<24} {:>10} {:>9} {:>22}\n", "route", "landmarks", "sweeps",
                           "mean change of error");
  for (const RouteResult& route : routes) {
    for (std::size_t b = 0; b + 1 < std::size(kBounds); ++b) {
      std::size_t count = 0;
      double sum = 0.0;
      for (const Sample& sample : route.samples) {
        if (sample.landmarks < kBounds[b] || sample.landmarks >= kBounds[b + 1]) continue;
        ++count;
        sum += sample.change_m;
      }
      if (count == 0) continue;
      const std::string range = kBounds[b + 1] == kBounds[b] + 1
                                    ? fmt::format("{}", kBounds[b])
                                    : fmt::format("{}..{}", kBounds[b], kBounds[b + 1] - 1);
      std::cout << fmt::format("{:<24} {:>10} {:>9} {:>19.2f} mm\n", route.name, range, count,
                               1e3 * sum / static_cast<double>(count));
    }
  }
}

void run(const Options& options) {
  const auto& stop = stop_on_interrupt();
  struct Route {
    std::string name;
    std::function<sim::Scenario()> scenario;
    std::uint64_t seed;
  };
  // The first two share their way; noise and biases differ, as on two days.
  const std::vector<Route> routes = {
      {"City to country 1",
       [&] { return sim::urban_to_countryside_scenario(options.length_m, options.seed); },
       options.seed},
      {"City to country 2",
       [&] { return sim::urban_to_countryside_scenario(options.length_m, options.seed); },
       options.seed + 1},
      {"Countryside",
       [&] { return sim::countryside_scenario(1.5 * options.length_m, options.seed); },
       options.seed},
  };
  std::vector<RouteResult> results(routes.size());
  run_in_parallel(routes.size(), options.jobs, "landmarks-vs-error", stop, [&](std::size_t i) {
    sim::SensorDrive drive(routes[i].scenario(), sim::SpeedParameters{}, sim::SensorSuite{},
                           routes[i].seed);
    ChainOptions chain;
    chain.config_dir = options.config_dir;
    chain.progress = [&](double) {
      if (stop) throw std::runtime_error("interrupted");
    };
    results[i] = {routes[i].name, samples_of(drive_chain(drive, chain))};
  });
  print(results);
  if (options.json.empty()) return;
  nlohmann::json traces = nlohmann::json::array();
  for (const RouteResult& result : results) {
    nlohmann::json samples = nlohmann::json::array();
    for (const Sample& sample : result.samples) {
      samples.push_back({sample.time_s, sample.landmarks, sample.change_m});
    }
    traces.push_back({{"route", result.name}, {"samples", samples}});
  }
  const nlohmann::json config = {{"seed", options.seed}, {"length_m", options.length_m}};
  write_json(options.json, result_document("landmarks-vs-error", config, rows_of(results)));
  write_json(traces_file(options.json), traces);
  if (options.plots) {
    plot("landmarks_vs_error.py", {options.json, traces_file(options.json).string()});
  }
}

}  // namespace

void add_landmarks_vs_error_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "landmarks-vs-error", "Change of the error against the number of landmarks in view");
  auto options = std::make_shared<Options>();
  command->add_option("--seed", options->seed, "Seed of everything");
  command->add_option("--jobs", options->jobs, "Drives side by side")->check(CLI::Range(1, 256));
  command->add_option("--length-m", options->length_m, "Of the city routes; the country is 1.5 x")
      ->check(CLI::Range(200.0, 100000.0));
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");
  command->add_option("--json", options->json, "Results; traces and plots go beside it");
  command->add_flag("!--no-plots", options->plots, "No plots");
  command->callback([options] { run_guarded("landmarks-vs-error", [options] { run(*options); }); });
}

}  // namespace understory::eval
