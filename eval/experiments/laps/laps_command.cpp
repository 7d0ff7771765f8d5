// `understory eval laps`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/laps/laps.hpp"
#include "eval/harness/results.hpp"

namespace understory::eval::experiments::laps {
namespace {

/// Hours at the beginning that are not in the slope: what has a bound fills up to it.
constexpr double kFirstShare = 0.5;

void print_header(const char* what) {
  fmt::print("{:<10} {:>7} {:>9} {:>9} {:>13} {:>8} {:>12} {:>7} {:>7} {:>9}\n", what, "hours",
             "heap MiB", "state MiB", "p99/max ms", "ATE mm", "NEES/max", "poses", "unsure",
             "keyframes");
}

void print_row(const Lap& lap) {
  fmt::print(
      "{:<10} {:>7.2f} {:>9.2f} {:>9.3f} {:>7.2f}{:>6.1f} {:>8.1f} {:>6.2f}{:>6.0f} {:>7} {:>7} "
      "{:>9}\n",
      lap.number, lap.hours, lap.heap_mib, lap.mapper_state_mib, lap.mapper_p99_ms,
      lap.mapper_largest_ms, 1e3 * lap.ate_m, lap.mean_nees, lap.largest_nees, lap.poses,
      lap.unsure, fmt::format("{}/{}", lap.keyframes, lap.keyframes + lap.refused));
  std::fflush(stdout);
}

/// Least-squares slope of the heap over the last half of the hours [MiB/h].
double slope_mib_per_h(const std::vector<Lap>& laps) {
  double n = 0.0;
  double x = 0.0;
  double y = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = static_cast<std::size_t>(kFirstShare * static_cast<double>(laps.size()));
       i < laps.size(); ++i) {
    n += 1.0;
    x += laps[i].hours;
    y += laps[i].heap_mib;
    xx += laps[i].hours * laps[i].hours;
    xy += laps[i].hours * laps[i].heap_mib;
  }
  const double spread = n * xx - x * x;
  return spread > 0.0 ? (n * xy - x * y) / spread : 0.0;
}

nlohmann::json to_json(const char* part, const std::vector<Lap>& laps) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Lap& lap : laps) {
    rows.push_back({{"part", part},
                    {"number", lap.number},
                    {"hours", lap.hours},
                    {"heap_mib", lap.heap_mib},
                    {"mapper_state_mib", lap.mapper_state_mib},
                    {"mapper_p99_ms", lap.mapper_p99_ms},
                    {"mapper_largest_ms", lap.mapper_largest_ms},
                    {"ate_m", lap.ate_m},
                    {"mean_nees", lap.mean_nees},
                    {"largest_nees", lap.largest_nees},
                    {"poses", lap.poses},
                    {"unsure", lap.unsure},
                    {"keyframes", lap.keyframes},
                    {"refused", lap.refused}});
  }
  return rows;
}

/// Of the map that is localised in; empty where there is none.
std::string map_bytes(const LapsOptions& options) {
  return options.localise_in.empty() ? std::string() : io::read_whole_file(options.localise_in);
}

void run(const LapsOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  RecordedLap recorded;
  print_header("lap");
  const std::vector<Lap> laps = drive_laps(options, stop, recorded, print_row);
  fmt::print("slope of the last half: {:.2f} MiB/h\n", slope_mib_per_h(laps));

  bool is_map_as_it_was = false;
  std::vector<Lap> stretches;
  if (options.hours > 0.0) {
    if (!options.localise_in.empty()) write_lap_map(options, recorded);
    const std::string map = map_bytes(options);
    print_header("half hour");
    std::uint64_t map_changes = 0;
    stretches = repeat_lap(options, stop, recorded, map_changes, print_row);
    fmt::print("slope of the last half: {:.2f} MiB/h\n", slope_mib_per_h(stretches));
    is_map_as_it_was = map == map_bytes(options) && map_changes == 0;
    if (!options.localise_in.empty())
      fmt::print("{}: {}, {} changes told\n", options.localise_in.string(),
                 is_map_as_it_was ? "the same bytes" : "CHANGED", map_changes);
  }
  if (options.json.empty()) return;

  nlohmann::json rows = to_json("laps", laps);
  for (const nlohmann::json& row : to_json("hours", stretches)) rows.push_back(row);
  const nlohmann::json config = {{"seed", options.seed},
                                 {"laps", options.laps},
                                 {"length_m", options.length_m},
                                 {"beams", options.beams},
                                 {"hours", options.hours},
                                 {"config", options.config_dir.string()},
                                 {"known_ground_m", options.known_ground_m},
                                 {"localisation_only", !options.localise_in.empty()},
                                 {"map_unchanged", is_map_as_it_was},
                                 {"slope_laps_mib_per_h", slope_mib_per_h(laps)},
                                 {"slope_hours_mib_per_h", slope_mib_per_h(stretches)}};
  harness::write_json(options.json, harness::result_document("laps", config, rows));
  if (options.plots) harness::plot("laps.py", {options.json});
}

}  // namespace

void add_laps_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "laps", "Many laps of one path, from raw LIDAR: memory, latency, accuracy, lap by lap");
  auto options = std::make_shared<LapsOptions>();
  add_number(*command, "--laps", options->laps, 2, 100000, "Laps from raw LIDAR");
  add_number(*command, "--length-m", options->length_m, 100.0, 100000.0, "Length of a lap [m]");
  command->add_option("--beams", options->beams, "Beams of the LIDAR")
      ->check(CLI::IsMember({16, 32}))
      ->capture_default_str();
  add_number(*command, "--hours", options->hours, 0.0, 10000.0,
             "Then this many hours of only keyframer and mapper, from an empty map, with the "
             "LANDMARKS and ODOMETRY of the last lap but one repeated");
  command->add_option("--localise-in", options->localise_in,
                      "Map file for the hours, which then only localise; if it does not exist, it "
                      "gets the map of the recorded lap");
  command->add_option("--known-ground-m", options->known_ground_m,
                      "Value of smoothing.known_ground_m; 0: every keyframe is kept");
  command->add_option("--seed", options->seed, "Seed of everything")->capture_default_str();
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");
  command->add_option("--json", options->json, "Result file; a plot goes beside it");
  command->add_flag("!--no-plots", options->plots, "No plot");
  command->callback([options] { run_guarded("laps", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::laps
