// eval paths, density and noise (GeoSLAM §5.1-5.3): accuracy of the map along simulated drives.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "eval/experiments.hpp"
#include "eval/interrupt.hpp"
#include "eval/results.hpp"
#include "eval/summary.hpp"

namespace understory::eval {
namespace {

/// Filters on the cells of the noise grid.
struct NoiseOptions {
  CampaignOptions campaign;
  std::vector<int> sigmas_cm;
  std::vector<int> detections_pct;
  std::vector<int> intervals_cm{20, 10};
};

template <typename Value>
bool selected(const std::vector<Value>& filter, const Value& value) {
  return filter.empty() || std::find(filter.begin(), filter.end(), value) != filter.end();
}

std::vector<Cell> path_cells(const std::vector<std::string>& names) {
  std::vector<Cell> cells;
  for (const sim::PathKind path :
       {sim::PathKind::kCircle, sim::PathKind::kLine, sim::PathKind::kFigureEight,
        sim::PathKind::kDoubleCircle, sim::PathKind::kSquare, sim::PathKind::kTriangle}) {
    if (!selected(names, std::string(sim::to_string(path)))) continue;
    Cell cell;
    cell.path = path;
    cell.published = source_path_figures(path);
    cells.push_back(cell);
  }
  return cells;
}

std::vector<Cell> density_cells() {
  std::vector<Cell> cells;
  for (const sim::ForestKind forest :
       {sim::ForestKind::kDense, sim::ForestKind::kIntermediate, sim::ForestKind::kSparse}) {
    Cell cell;
    cell.forest = forest;
    cell.published = source_density_figures(forest);
    cells.push_back(cell);
  }
  return cells;
}

std::vector<Cell> noise_cells(const NoiseOptions& options) {
  std::vector<Cell> cells;
  for (const int interval_cm : options.intervals_cm) {
    for (std::size_t row = 0; row < kNoiseSigmas_m.size(); ++row) {
      for (std::size_t column = 0; column < kNoiseDetection.size(); ++column) {
        Cell cell;
        cell.sigma_m = kNoiseSigmas_m[row];
        cell.detection = kNoiseDetection[column];
        cell.interval_m = 0.01 * interval_cm;
        cell.published =
            SourceFigures{kSourceNoiseRpe_cm[row][column], kSourceNoiseLpe_cm[row][column], {}, {}};
        const auto sigma_cm = static_cast<int>(std::lround(100.0 * cell.sigma_m));
        const auto detection_pct = static_cast<int>(std::lround(100.0 * cell.detection));
        if (!selected(options.sigmas_cm, sigma_cm)) continue;
        if (!selected(options.detections_pct, detection_pct)) continue;
        cells.push_back(cell);
      }
    }
  }
  return cells;
}

void run_accuracy(const std::string& experiment, const std::vector<Cell>& cells,
                  CampaignOptions options) {
  const auto lidar = std::find(options.methods.begin(), options.methods.end(), kLidarMethod);
  if (lidar != options.methods.end()) options.methods.insert(lidar + 1, kLidarFilter);
  const std::vector<CellResult> results = run_campaign(cells, options, stop_on_interrupt());
  const std::vector<Summary> rows = summarise(results, options.methods);
  fmt::print("eval {}: {} runs per cell, seed {}; the source's published figures on the right\n{}",
             experiment, options.runs, options.seed, to_table(rows));
  if (options.json.empty()) return;
  nlohmann::json json_rows = nlohmann::json::array();
  for (const Summary& row : rows) json_rows.push_back(to_json(row));
  const nlohmann::json config{
      {"runs", options.runs}, {"seed", options.seed}, {"methods", options.methods}};
  write_json(traces_file(options.json), traces_of(results, options));
  write_json(options.json, result_document(experiment, config, json_rows));
  if (options.plots) plot("accuracy.py", {options.json, traces_file(options.json).string()});
}

}  // namespace

void add_paths_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand("paths", "Accuracy on the source's five paths");
  const auto options = std::make_shared<CampaignOptions>();
  const auto paths = std::make_shared<std::vector<std::string>>();
  add_campaign_options_with_lidar(command, *options);
  command.add_option("--path", *paths, "Only these paths")
      ->delimiter(',')
      ->check(
          CLI::IsMember({"circle", "line", "figure-eight", "double-circle", "square", "triangle"}));
  command.callback([options, paths] {
    run_guarded("paths", [&] { run_accuracy("paths", path_cells(*paths), *options); });
  });
}

void add_density_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand("density", "Accuracy in three forests");
  const auto options = std::make_shared<CampaignOptions>();
  add_campaign_options_with_lidar(command, *options);
  command.callback([options] {
    run_guarded("density", [&] { run_accuracy("density", density_cells(), *options); });
  });
}

void add_noise_experiment(CLI::App& eval) {
  CLI::App& command =
      *eval.add_subcommand("noise", "Accuracy against position and detection noise");
  const auto options = std::make_shared<NoiseOptions>();
  add_campaign_options(command, options->campaign);
  command.add_option("--sigma", options->sigmas_cm, "Only these position noises [cm]")
      ->delimiter(',')
      ->check(CLI::IsMember({0, 10, 20, 30, 40}));
  command.add_option("--detection", options->detections_pct, "Only these detection rates [%]")
      ->delimiter(',')
      ->check(CLI::IsMember({100, 95, 90, 85, 80}));
  command.add_option("--interval", options->intervals_cm, "Intervals between observations [cm]")
      ->delimiter(',')
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command.callback([options] {
    run_guarded("noise", [&] { run_accuracy("noise", noise_cells(*options), options->campaign); });
  });
}

}  // namespace understory::eval
