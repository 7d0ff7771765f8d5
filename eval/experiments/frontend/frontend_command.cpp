// `understory eval frontend`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::frontend {
namespace {

namespace fs = std::filesystem;

struct ChainDrive {
  std::string name;
  std::function<sim::Scenario()> scenario;
  std::optional<double> ate_target_m;
  bool has_gnss = true;
};

std::vector<ChainDrive> chain_drives(const FrontendOptions& options) {
  const std::uint64_t seed = options.seed;
  return {
      {fmt::format("forest, {:.0f} m circle", options.drive_m),
       [=, length = options.drive_m] {
         sim::ForestScenarioParameters forest;
         forest.length_m = length;
         return sim::forest_scenario(forest, seed);
       },
       0.10},
      {"urban block, closed, no GNSS", [=] { return sim::urban_scenario(1, seed); }, std::nullopt,
       false},
      {"urban to countryside, 2 km",
       [=] { return sim::urban_to_countryside_scenario(2000.0, seed); }, std::nullopt},
      {"countryside, 2 km", [=] { return sim::countryside_scenario(2000.0, seed); }, std::nullopt},
  };
}

/// Real maps of poles with the real ways of a car through them, where the recordings are there.
void add_pole_drives(const FrontendOptions& options, std::vector<ChainDrive>& drives) {
  for (const char* sequence : {"00", "02"}) {
    const fs::path folder = options.data / "pole_maps";
    const fs::path poles = folder / fmt::format("seq{}_poles.csv", sequence);
    const fs::path way = folder / fmt::format("seq{}_traj.csv", sequence);
    if (!fs::exists(poles) || !fs::exists(way)) continue;
    drives.push_back({fmt::format("poles of KITTI {}", sequence),
                      [=, seed = options.seed] {
                        auto result = sim::pole_map_scenario(io::read_whole_file(poles),
                                                             io::read_whole_file(way), seed);
                        if (!result.scenario) throw std::runtime_error(result.error);
                        return *result.scenario;
                      },
                      std::nullopt});
  }
}

void add_drive_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                    FrontendRows& rows, nlohmann::json& traces) {
  std::vector<ChainDrive> drives = chain_drives(options);
  add_pole_drives(options, drives);
  std::erase_if(drives, [&](const ChainDrive& drive) {
    return !options.sections.empty() &&
           std::ranges::none_of(options.sections, [&](const std::string& section) {
             return section == "chain" || drive.name.starts_with(section);
           });
  });

  std::vector<harness::ChainRun> runs(drives.size());
  tools::run_in_parallel(drives.size(), options.jobs, "chain", stop, [&](std::size_t i) {
    sim::SensorSuite suite;
    if (!drives[i].has_gnss) suite.gnss.reset();
    sim::SensorDrive drive(drives[i].scenario(), sim::SpeedParameters{}, suite, options.seed);
    harness::ChainOptions chain;
    chain.config_dir = options.config_dir;
    chain.progress = [&](double) {
      if (stop) throw std::runtime_error("interrupted");
    };
    runs[i] = drive_chain(drive, chain);
  });

  for (std::size_t i = 0; i < drives.size(); ++i) {
    rows.in("whole chain, simulated " + drives[i].name + ", 32 beams");
    add_chain_rows(runs[i], drives[i].ate_target_m, rows);
    traces[drives[i].name] = trace_of(runs[i]);
  }
}

bool wants(const FrontendOptions& options, const std::string& section) {
  return options.sections.empty() ||
         std::ranges::find(options.sections, section) != options.sections.end();
}

/// By its name alone: an experiment beside the others.
bool asks_for(const FrontendOptions& options, const std::string& section) {
  return !options.sections.empty() && wants(options, section);
}

void run(const FrontendOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  FrontendRows rows;
  nlohmann::json traces = nlohmann::json::object();

  if (wants(options, "extraction")) add_extraction_rows(options, stop, rows);
  nlohmann::json plots = nlohmann::json::object();
  if (wants(options, "forest-plots")) add_forest_plot_rows(options, stop, rows, plots);
  if (wants(options, "tracking")) add_tracking_rows(options, stop, rows);
  if (wants(options, "filter")) add_filter_rows(options, stop, rows);
  if (asks_for(options, "planar")) add_planar_rows(options, stop, rows);
  if (asks_for(options, "limit")) add_limit_rows(options, stop, rows);
  if (asks_for(options, "mismatch")) add_mismatch_rows(options, stop, rows);
  add_drive_rows(options, stop, rows, traces);
  if (wants(options, "faults")) add_fault_rows(options, stop, rows);

  std::cout << to_table(rows.rows());
  if (options.json.empty()) return;

  const nlohmann::json config = {{"seed", options.seed}, {"runs", options.runs}};
  harness::write_json(options.json,
                      harness::result_document("frontend", config, to_json(rows.rows())));
  harness::write_json(harness::traces_file(options.json), traces);

  if (!plots.empty()) {
    // The clouds may not be redistributed: their picture is kept, they are not.
    fs::path file = options.json;
    file.replace_extension(".plots.json");
    harness::write_json(file, plots);
    if (options.plots) harness::plot("forest_plots.py", {options.json, file.string()});
  }
  if (options.plots && !traces.empty()) {
    harness::plot("frontend.py", {options.json, harness::traces_file(options.json).string()});
  }
}

}  // namespace

void add_frontend_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "frontend", "From raw sensors to a pose: extraction, tracks, filter, whole chain, faults");
  auto options = std::make_shared<FrontendOptions>();
  options->config_dir = "deploy/config/lidar";

  add_number(*command, "--runs", options->runs, 1, 100000,
             "Runs of the filter; those of other parts follow from this number");
  command->add_option("--seed", options->seed, "Seed of everything");
  add_number(*command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");

  const char* const data = std::getenv("UNDERSTORY_DATA");  // NOLINT(concurrency-mt-unsafe)
  options->data = data != nullptr ? data : "../shared/data";
  command->add_option("--data", options->data, "Folder with pole_maps; default $UNDERSTORY_DATA");
  command->add_option("--json", options->json, "Results; traces and plots go beside it");
  command
      ->add_option("--only", options->sections,
                   "Parts of it, or drives of the chain (forest, urban, country, poles). Run only "
                   "if named: planar (a laser with one plane while the vehicle turns), limit (the "
                   "chain beside the batch solution), mismatch (sway and sensor errors 0.5 and 2 "
                   "times those of the filter's parameters)")
      ->check(
          CLI::IsMember({"extraction", "forest-plots", "tracking", "filter", "chain", "faults",
                         "forest", "urban", "country", "poles", "planar", "limit", "mismatch"}));
  command->add_flag("!--no-plots", options->plots, "No plots");

  command->callback([options] { run_guarded("frontend", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::frontend
