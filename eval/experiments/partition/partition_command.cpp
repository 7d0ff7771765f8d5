// The command lines of `eval partition`, `partition-loop`, `partition-dynamic` and
// `partition-dynamic-loop` (thesis on submaps, chapter 5).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <iostream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/partition/comparison.hpp"
#include "eval/experiments/partition/drive_recording.hpp"
#include "eval/experiments/partition/partition.hpp"
#include "eval/experiments/partition/partition_rows.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::partition {
namespace {

using nlohmann::json;

/// Of the closed urban drive, which the open one is the beginning of: its end is that far from its
/// start [m].
constexpr double kClosedUrban_m = 770.0;
constexpr double kOpenUrban_m = 600.0;
constexpr double kCountry_m = 1000.0;
constexpr double kForest_m = 1000.0;
constexpr double kForestBlock_m = 700.0;

struct PartitionOptions {
  std::string experiment;
  bool is_closed = false;
  bool is_dynamic = false;
  bool all_designs = false;
  std::vector<std::string> routes;
  std::vector<std::string> front_ends{"ideal"};
  std::vector<double> sizes_m{5.0, 10.0, 20.0, 40.0, 100.0, 200.0, 300.0, 400.0, 500.0};
  int runs = 20;
  int lidar_runs = 3;
  std::uint64_t seed = 1;
  int jobs = 1;
  RecordingOptions recording;
  bool plots = true;
  std::string json;
};

/// One drive of the experiment.
struct PartitionJob {
  std::string route;
  std::string front_end;
  int run = 0;
};

std::vector<PartitionJob> jobs_of(const PartitionOptions& options) {
  std::vector<PartitionJob> jobs;
  for (const std::string& front_end : options.front_ends) {
    for (const std::string& route : options.routes) {
      const bool is_drawn = route == "road" || route == "block";
      if (front_end == "lidar" && is_drawn) continue;
      const int runs = front_end == "lidar" ? options.lidar_runs : options.runs;
      for (int run = 0; run < runs; ++run) jobs.push_back({route, front_end, run});
    }
  }
  return jobs;
}

RecordedDrive drive_of(const PartitionJob& job, const PartitionOptions& options,
                       const std::atomic<bool>& stop) {
  const std::uint64_t seed = harness::run_seed(options.seed, job.run);
  if (job.route == "road" || job.route == "block") {
    RouteParameters parameters;
    parameters.length_m = kForest_m;
    if (job.route == "block") parameters.block_m = kForestBlock_m;
    Route route(parameters, seed);
    return record(route);
  }

  const bool is_urban = job.route == "urban";
  const FrontEnd front_end = job.front_end == "lidar" ? FrontEnd::kLidar : FrontEnd::kIdeal;
  const RecordedDrive drive = record({job.route, is_urban ? kClosedUrban_m : kCountry_m}, front_end,
                                     seed, options.recording, stop);
  return is_urban && !options.is_closed ? drive.first(kOpenUrban_m) : drive;
}

RouteRun run_job(const PartitionJob& job, const PartitionOptions& options,
                 const std::atomic<bool>& stop) {
  ComparisonOptions comparison;
  comparison.policies = options.is_dynamic ? dynamic_policies() : static_policies(options.sizes_m);
  comparison.is_closed = options.is_closed;
  comparison.all_designs = options.all_designs;
  const RecordedDrive drive = drive_of(job, options, stop);
  const auto parameters = job.front_end == "lidar"
                              ? configured_parameters(options.recording.config_dir)
                              : ideal_parameters();
  RouteRun result{job.route, job.front_end, job.run, compare(drive, parameters, comparison)};
  // Only run 0 is drawn.
  if (job.run > 0)
    for (Outcome& outcome : result.outcomes) outcome.trajectory = {};
  return result;
}

json config_of(const PartitionOptions& options) {
  return {{"seed", options.seed},
          {"runs", options.runs},
          {"lidar_runs", options.lidar_runs},
          {"routes", options.routes},
          {"front_ends", options.front_ends},
          {"is_closed", options.is_closed},
          {"config", options.recording.config_dir.string()}};
}

void run_partition(const PartitionOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  const std::vector<PartitionJob> jobs = jobs_of(options);
  std::vector<RouteRun> runs(jobs.size());
  tools::run_in_parallel(jobs.size(), options.jobs, options.experiment, stop,
                         [&](std::size_t i) { runs[i] = run_job(jobs[i], options, stop); });

  const json rows = rows_of(runs, options.is_closed);
  std::cout << table_of(rows);
  if (options.json.empty()) return;

  json document = harness::result_document(options.experiment, config_of(options), rows);
  document["effects"] = effects_of(runs);
  harness::write_json(options.json, document);
  harness::write_json(harness::traces_file(options.json), traces_of(runs));
  if (options.plots) harness::plot("partition.py", {options.json});
}

void add_partition(CLI::App& eval, const std::string& name, const std::string& description,
                   bool is_closed, bool is_dynamic) {
  auto* command = eval.add_subcommand(name, description);
  auto options = std::make_shared<PartitionOptions>();
  options->experiment = name;
  options->is_closed = is_closed;
  options->is_dynamic = is_dynamic;
  options->routes = {"urban"};
  if (!is_closed)
    options->routes.insert(options->routes.end(), {"urban-countryside", "countryside"});

  add_number(*command, "--runs", options->runs, 1, 100000, "Drives per route with ideal landmarks");
  add_number(*command, "--lidar-runs", options->lidar_runs, 1, 100000,
             "Drives per route with the LIDAR chain");
  command->add_option("--seed", options->seed, "Seed of all randomness")->capture_default_str();
  add_number(*command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command
      ->add_option("--routes", options->routes,
                   "Routes of the thesis; road and block are in a forest")
      ->delimiter(',')
      ->check(CLI::IsMember(is_closed ? std::vector<std::string>{"urban", "block"}
                                      : std::vector<std::string>{"urban", "urban-countryside",
                                                                 "countryside", "road"}))
      ->capture_default_str();
  command->add_option("--front-end", options->front_ends, "ideal, lidar or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"ideal", "lidar"}))
      ->capture_default_str();
  if (!is_dynamic) {
    command->add_option("--size-m", options->sizes_m, "Path length of a submap [m]")
        ->delimiter(',')
        ->check(CLI::Range(5.0, 1000.0))
        ->capture_default_str();
  }
  command->add_flag("--all-designs", options->all_designs,
                    "Variants of the baseline: unscented, joint covariance, full solution");
  command->add_option("--recordings", options->recording.folder,
                      "Folder in which drives are kept for later runs");
  command->add_option("--config", options->recording.config_dir, "Configuration of the chain")
      ->capture_default_str();
  command->add_option("--json", options->json, "Result file; plots go beside it");
  command->add_flag("!--no-plots", options->plots, "Write JSON only");
  command->callback(
      [options] { run_guarded(options->experiment, [options] { run_partition(*options); }); });
}

}  // namespace

void add_partition_experiments(CLI::App& eval) {
  add_partition(eval, "partition",
                "The map cut after a distance, against the uncut map (thesis on submaps 5.1)",
                false, false);
  add_partition(eval, "partition-loop", "The same round a block, with loop closure (5.2)", true,
                false);
  add_partition(eval, "partition-dynamic",
                "The map cut where landmarks are few or many, at turns or at a size (5.3)", false,
                true);
  add_partition(eval, "partition-dynamic-loop", "The same round a block, with loop closure (5.4)",
                true, true);
}

}  // namespace understory::eval::experiments::partition
