// The command lines of `eval long-drive` and `eval long-drive-loop`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/partition/partition.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"

namespace understory::eval::experiments::partition {
namespace {

constexpr const char* kLongDrive = "long-drive";
constexpr const char* kLongDriveLoop = "long-drive-loop";

struct LongDriveOptions {
  std::string experiment;
  RouteParameters route;
  std::vector<double> sizes_m{5.0, 10.0, 20.0, 40.0, 100.0, 200.0, 500.0};
  double hand_over_m = 0.0;
  int runs = 3;
  std::uint64_t seed = 1;
  std::size_t sections = 1;
  bool has_uncut = true;
  bool plots = true;
  std::string json;
};

/// Sums over the runs of one size.
struct LongDriveCell {
  double size_m = 0.0;
  std::vector<double> to_uncut_m;
  std::vector<double> to_truth_m;
  std::vector<double> uncut_to_truth_m;
  double nees = 0.0;
  double closure_ms = 0.0;
  std::size_t refused = 0;
  std::size_t disk_bytes = 0;     ///< Of the last run.
  std::size_t brought_back = 0;   ///< Likewise.
  std::vector<Section> sections;  ///< Of the last run.
};

double root_mean_square(const std::vector<double>& values) {
  double squared = 0.0;
  for (const double value : values) squared += value * value;
  return values.empty() ? 0.0 : std::sqrt(squared / static_cast<double>(values.size()));
}

double largest_of(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

nlohmann::json long_drive_row(const LongDriveCell& cell, const LongDriveOptions& options) {
  nlohmann::json row{{"route", options.experiment == kLongDrive ? "open" : "closed"},
                     {"policy", cell.size_m > 0.0 ? "distance" : "uncut"},
                     {"size_m", cell.size_m},
                     {"runs", cell.to_truth_m.size()},
                     {"rmse_to_reference_m", root_mean_square(cell.to_truth_m)},
                     {"mean_nees", cell.nees},
                     {"closure_s", 1e-3 * cell.closure_ms},
                     {"disk_mb_per_km", 1e-6 * static_cast<double>(cell.disk_bytes) /
                                            (1e-3 * options.route.length_m)},
                     {"brought_back", cell.brought_back},
                     {"refused", cell.refused}};

  if (options.has_uncut) {
    row["rmse_to_uncut_m"] = root_mean_square(cell.to_uncut_m);
    row["worst_rmse_to_uncut_m"] = largest_of(cell.to_uncut_m);
    row["uncut_rmse_to_reference_m"] = root_mean_square(cell.uncut_to_truth_m);
  }

  for (const Section& section : cell.sections) {
    row["sections"].push_back({{"end_m", section.end_m},
                               {"ms_p50", section.ms_p50},
                               {"ms_p99", section.ms_p99},
                               {"ms_max", section.ms_max},
                               {"rss_mb", section.resident_mb},
                               {"mapper_mb", section.mapper_mb}});
  }
  return row;
}

void print_header(const LongDriveOptions& options) {
  fmt::print("{}: {} run(s) of {:.0f} m from seed {}, {:.0f} landmarks per km^2\n",
             options.experiment, options.runs, options.route.length_m, options.seed,
             options.route.landmarks_per_km2);
  fmt::print("{:>8} {:>12} {:>10} {:>12} {:>10} {:>6} {:>10} {:>8} {:>8} {:>8} {:>8} {:>9}\n",
             "size m", "to uncut m", "worst m", "to truth m", "uncut m", "NEES", "closure ms",
             "p50 ms", "p99 ms", "max ms", "RSS MB", "mapper MB");
}

void print_cell(const LongDriveCell& cell) {
  for (const Section& section : cell.sections) {
    fmt::print(
        "{:>8.0f} {:>12.4f} {:>10.4f} {:>12.4f} {:>10.4f} {:>6.2f} {:>10.1f} {:>8.2f} {:>8.2f} "
        "{:>8.2f} {:>8.1f} {:>9.2f}\n",
        cell.size_m, root_mean_square(cell.to_uncut_m), largest_of(cell.to_uncut_m),
        root_mean_square(cell.to_truth_m), root_mean_square(cell.uncut_to_truth_m), cell.nees,
        cell.closure_ms, section.ms_p50, section.ms_p99, section.ms_max, section.resident_mb,
        section.mapper_mb);
  }
  std::fflush(stdout);
}

void run_long_drive(const LongDriveOptions& options) {
  terminal::catch_interrupts();
  std::vector<DriveResult> uncut;
  const auto seed_of = [&](int run) { return harness::run_seed(options.seed, run); };
  for (int run = 0; run < options.runs && options.has_uncut; ++run)
    uncut.push_back(drive(options.route, seed_of(run), {}, options.sections));

  nlohmann::json rows = nlohmann::json::array();
  print_header(options);
  for (const double size_m : options.sizes_m) {
    LongDriveCell cell;
    cell.size_m = size_m;
    for (int run = 0; run < options.runs; ++run) {
      const DriveResult one =
          drive(options.route, seed_of(run), {size_m, options.hand_over_m}, options.sections);
      if (options.has_uncut) {
        const DriveResult& whole = uncut[static_cast<std::size_t>(run)];
        cell.to_uncut_m.push_back(rmse_m(one.trajectory, whole.trajectory));
        cell.uncut_to_truth_m.push_back(whole.rmse_to_truth_m);
      }
      cell.to_truth_m.push_back(one.rmse_to_truth_m);
      cell.nees += one.mean_nees / options.runs;
      cell.closure_ms = std::max(cell.closure_ms, one.closure_ms);
      cell.refused += one.refused;
      cell.disk_bytes = one.disk_bytes;
      cell.brought_back = one.brought_back;
      cell.sections = one.sections;
    }
    print_cell(cell);
    rows.push_back(long_drive_row(cell, options));
  }

  if (options.json.empty()) return;
  const nlohmann::json config = {{"seed", options.seed},
                                 {"runs", options.runs},
                                 {"length_m", options.route.length_m},
                                 {"block_m", options.route.block_m},
                                 {"hand_over_m", options.hand_over_m}};
  harness::write_json(options.json, harness::result_document(options.experiment, config, rows));
  if (options.plots) harness::plot("long_drive.py", {options.json});
}

void add_long_drive(CLI::App& eval, const std::string& name, const std::string& description) {
  auto* command = eval.add_subcommand(name, description);
  auto options = std::make_shared<LongDriveOptions>();
  options->experiment = name;
  if (name == kLongDriveLoop) {
    options->route.block_m = 700.0;
    options->route.length_m = 1000.0;
  }

  add_number(*command, "--runs", options->runs, 1, 100000, "Drives per size");
  command->add_option("--seed", options->seed, "Seed of all randomness")->capture_default_str();
  add_number(*command, "--length-m", options->route.length_m, 50.0, 1e6, "Length of the drive [m]");
  if (name == kLongDriveLoop) {
    add_number(*command, "--block-m", options->route.block_m, 200.0, 1e6,
               "Circumference of the block [m]");
  }
  command->add_option("--size-m", options->sizes_m, "Path that is condensed to one node [m]")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 1e4))
      ->capture_default_str();
  add_number(*command, "--hand-over-m", options->hand_over_m, 0.0, 1e6,
             "Map parts farther from the vehicle than this go to the disk [m]; 0 = none");
  add_number(*command, "--sections", options->sections, 1, 1000,
             "Parts of the drive with a time each");

  command->add_flag("!--no-uncut", options->has_uncut, "Skip the same drives uncut");
  command->add_option("--json", options->json, "Result file; a plot goes beside it");
  command->add_flag("!--no-plots", options->plots, "Write JSON only");
  command->callback(
      [options] { run_guarded(options->experiment, [options] { run_long_drive(*options); }); });
}

}  // namespace

void add_long_drive_experiments(CLI::App& eval) {
  add_long_drive(eval, kLongDrive,
                 "A road with stretches condensed beside the same road uncut: error, time, memory");
  add_long_drive(eval, kLongDriveLoop, "The same round a block that is closed");
}

}  // namespace understory::eval::experiments::partition
