// eval backend: the smoother on standard graphs, beside the field's reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/io/output_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "eval/experiments/backend/backend.hpp"
#include "eval/experiments/backend/backend_table.hpp"
#include "eval/experiments/backend/backend_world.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"

namespace understory::eval::experiments::backend {
namespace {

struct BackendOptions {
  std::vector<std::string> files;
  int world_poses = 0;
  std::uint64_t seed = 1;
  std::string json;
  bool plots = true;
};

/// Two street grids: with odometry that drifts, and with odometry far better than the closures.
std::vector<std::pair<std::string, WorldParameters>> worlds(int poses) {
  if (poses == 0) return {};
  WorldParameters drifting;
  drifting.poses = poses;
  WorldParameters precise = drifting;
  precise.motion_m = precise.motion_rad = 0.002;
  precise.closure_m = precise.closure_rad = 0.1;
  return {{fmt::format("streets-{}-drifting", poses), drifting},
          {fmt::format("streets-{}-precise", poses), precise}};
}

/// None where the file is refused, which is said: the others go on.
std::optional<BackendRun> run_file(const std::string& file) {
  try {
    return run_backend(std::filesystem::path(file));
  } catch (const std::exception& error) {
    fmt::print(stderr, "backend: {}\n", terminal::printable(error.what()));
    return std::nullopt;
  }
}

void write_results(const BackendOptions& options, const nlohmann::json& rows,
                   const nlohmann::json& traces) {
  const std::filesystem::path out = options.json;
  harness::write_json(harness::traces_file(out), traces);

  std::vector<std::string> names;  // names alone: folders are those of one machine
  for (const std::string& file : options.files) {
    names.push_back(std::filesystem::path(file).filename().string());
  }

  harness::write_json(
      out, harness::result_document(
               "backend",
               {{"files", names}, {"streets", options.world_poses}, {"seed", options.seed}}, rows));
  if (options.plots) harness::plot("backend.py", {out, harness::traces_file(out).string()});
}

void run_experiment(const BackendOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json traces = nlohmann::json::array();

  const auto keep = [&](const BackendRun& run) {
    rows.push_back(row_of(run));
    print_row(rows.back());
    traces.push_back(trace_of(run));
    if (stop) throw terminal::Interrupted{};
  };

  if (options.files.empty() && options.world_poses == 0) {
    throw std::invalid_argument("backend: neither --data nor --streets is given");
  }

  for (const std::string& file : options.files) {
    if (options.json.empty() || !io::is_same_file(file, options.json)) continue;
    throw std::invalid_argument("backend: --json " + options.json + " is one of the graphs");
  }

  print_heading();
  std::size_t refused = 0;
  for (const std::string& file : options.files) {
    if (const auto run = run_file(file)) {
      keep(*run);
    } else {
      ++refused;
    }
  }
  for (const auto& [name, parameters] : worlds(options.world_poses)) {
    keep(run_backend(make_world(parameters, options.seed), name));
  }

  if (!options.json.empty()) write_results(options, rows, traces);
  if (refused > 0) {
    throw std::runtime_error(fmt::format("{} of {} files refused", refused, options.files.size()));
  }
}

}  // namespace

void add_backend_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "backend", "The smoother on standard graphs, one pose per update (g2o, TORO, iSAM text)");
  const auto options = std::make_shared<BackendOptions>();
  command.add_option("--data", options->files, "Graph files")->check(CLI::ExistingFile);
  command
      .add_option("--streets", options->world_poses,
                  "Add simulated street grids with this number of poses")
      ->check(CLI::Range(2, 1'000'000));
  command.add_option("--seed", options->seed, "Seed of the simulated graphs")
      ->capture_default_str();
  command.add_option("--json", options->json, "Result file; times per update and plot beside it");
  command.add_flag("!--no-plots", options->plots, "Write JSON only");
  command.callback([options] { run_guarded("backend", [&] { run_experiment(*options); }); });
}

}  // namespace understory::eval::experiments::backend
