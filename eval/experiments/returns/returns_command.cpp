// `understory eval returns`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/returns/returns.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::returns {
namespace {

struct ReturnsOptions {
  int runs = 3;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::vector<std::string> maps;
  std::vector<double> drifts_m{5.0, 20.0, 50.0};
  std::vector<double> seen{0.64, 0.34};
  ReturnDrive drive;
  std::string json;
};

sim::Forest load(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  std::ostringstream text;
  text << in.rdbuf();
  sim::StemMapResult result = sim::parse_stem_map(text.str());
  if (!result.error.empty()) throw std::runtime_error(file + ": " + result.error);
  return result.forest;
}

struct NamedForest {
  std::string name;
  sim::Forest forest;
};

/// The surveyed ones, or a simulated one.
std::vector<NamedForest> forests_of(const ReturnsOptions& options) {
  std::vector<NamedForest> result;
  for (const std::string& file : options.maps)
    result.push_back({std::filesystem::path(file).stem().string(), load(file)});
  if (!result.empty()) return result;

  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = 200.0;
  std::mt19937_64 random(options.seed);
  result.push_back({"simulated", sim::make_forest(parameters, random)});
  return result;
}

nlohmann::json row_of(const std::string& map, const ReturnDrive& drive, std::uint64_t seed,
                      const ReturnScore& score) {
  return {{"map", map},
          {"drift_sigma_m", drive.drift_m},
          {"seen_share", drive.seen_share},
          {"run_seed", seed},
          {"drift_m", score.drift_m},
          {"merges", score.merges},
          {"false_merges", score.false_merges},
          {"separated", score.revoked},
          {"doubled", score.doubled},
          {"joined", score.joined},
          {"trunks", score.trunks},
          {"associations", score.associations},
          {"false_associations", score.false_associations},
          {"keyframes", score.keyframes},
          {"refused", score.refused},
          {"closed_after_m", score.first_closure_m},
          {"ate_m", score.ate_m},
          {"last_error_m", score.last_error_m},
          {"mean_nees", score.mean_nees},
          {"largest_nees", score.largest_nees},
          {"p99_ms", score.p99_ms},
          {"largest_ms", score.largest_ms}};
}

void print_header() {
  fmt::print(
      "{:<12} {:>6} {:>5} {:>7} {:>14} {:>13} {:>6} {:>13} {:>9} {:>8} {:>7} {:>7} {:>12} {:>13}\n",
      "map", "sigma", "seen", "drift m", "merges/bad/sep", "doubled/one", "trunks", "assoc./bad",
      "kf/ref.", "closed m", "ATE m", "last m", "NEES/max", "p99/max ms");
}

void print_row(const nlohmann::json& row) {
  const auto n = [&](const char* key) { return row[key].get<int>(); };
  const auto x = [&](const char* key) { return row[key].get<double>(); };
  fmt::print(
      "{:<12} {:>6.0f} {:>5.2f} {:>7.2f} {:>6}/{:<3}/{:<3} {:>7}/{:<5} {:>6} {:>8}/{:<4} "
      "{:>4}/{:<4} "
      "{:>8.0f} {:>7.2f} {:>7.2f} {:>6.2f}/{:<5.0f} {:>6.1f}/{:<6.1f}\n",
      row["map"].get<std::string>(), x("drift_sigma_m"), x("seen_share"), x("drift_m"), n("merges"),
      n("false_merges"), n("separated"), n("doubled"), n("joined"), n("trunks"), n("associations"),
      n("false_associations"), n("keyframes"), n("refused"), x("closed_after_m"), x("ate_m"),
      x("last_error_m"), x("mean_nees"), x("largest_nees"), x("p99_ms"), x("largest_ms"));
  std::fflush(stdout);
}

void run(const ReturnsOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  print_header();
  for (const NamedForest& map : forests_of(options)) {
    for (const double drift_m : options.drifts_m) {
      for (const double seen : options.seen) {
        ReturnDrive one = options.drive;
        one.drift_m = drift_m;
        one.seen_share = seen;
        std::vector<nlohmann::json> cell(static_cast<std::size_t>(options.runs));
        tools::run_in_parallel(cell.size(), options.jobs, map.name, stop, [&](std::size_t i) {
          const std::uint64_t seed = harness::run_seed(options.seed, static_cast<int>(i));
          cell[i] = row_of(map.name, one, seed, drive(one, map.forest, seed));
        });
        for (nlohmann::json& row : cell) {
          print_row(row);
          rows.push_back(std::move(row));
        }
      }
    }
  }
  if (options.json.empty()) return;
  const nlohmann::json config = {{"seed", options.seed},
                                 {"runs", options.runs},
                                 {"laps", options.drive.laps},
                                 {"sigma_m", options.drive.sigma_m},
                                 {"range_m", options.drive.range_m},
                                 {"blind_share", options.drive.blind_share}};
  harness::write_json(options.json, harness::result_document("returns", config, rows));
}

}  // namespace

void add_returns_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "returns", "A drive that drifts and returns to its own path: merges, closures, NEES");
  auto options = std::make_shared<ReturnsOptions>();
  add_number(*command, "--runs", options->runs, 1, 100000, "Drives per cell");
  command->add_option("--seed", options->seed, "Seed of all randomness")->capture_default_str();
  add_number(*command, "--jobs", options->jobs, 1, 1024, "Drives side by side");
  command->add_option("--map", options->maps,
                      "Stem maps (CSV with x_m,y_m); without one a simulated forest");
  command
      ->add_option("--drift-m", options->drifts_m, "1 sigma of the drift at the first return [m]")
      ->delimiter(',')
      ->check(CLI::Range(0.1, 200.0))
      ->capture_default_str();
  command->add_option("--seen", options->seen, "Shares of the trunks that are seen on a lap")
      ->delimiter(',')
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  add_number(*command, "--laps", options->drive.laps, 2, 100, "Laps");
  command->add_option("--json", options->json, "Result file");
  command->callback([options] { run_guarded("returns", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::returns
