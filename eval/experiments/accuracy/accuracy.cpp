// eval paths, density and noise (GeoSLAM §5.1-5.3): accuracy of the map along simulated drives.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"
#include "eval/harness/summary.hpp"

namespace understory::eval::experiments::accuracy {
namespace {

/// Of detections, as `--errors` names them.
using ErrorNames = std::vector<std::string>;

/// Filters on the cells of the noise grid.
struct NoiseOptions {
  harness::CampaignOptions campaign;
  std::vector<int> sigmas_cm;
  std::vector<int> detections_pct;
  std::vector<int> intervals_cm{20, 10};
  ErrorNames errors{"independent"};
};

template <typename Value>
bool selected(const std::vector<Value>& filter, const Value& value) {
  return filter.empty() || std::find(filter.begin(), filter.end(), value) != filter.end();
}

/// The cell with each of the wanted errors. Published figures are for independent ones.
void add_with_errors(harness::Cell cell, const ErrorNames& errors,
                     std::vector<harness::Cell>& cells) {
  for (const std::string& name : errors) {
    cell.errors = harness::errors_named(name);
    if (cell.errors != harness::Errors::kIndependent) cell.published.reset();
    cells.push_back(cell);
  }
}

std::vector<harness::Cell> path_cells(const std::vector<std::string>& names,
                                      const ErrorNames& errors) {
  std::vector<harness::Cell> cells;
  for (const sim::PathKind path :
       {sim::PathKind::kCircle, sim::PathKind::kLine, sim::PathKind::kFigureEight,
        sim::PathKind::kDoubleCircle, sim::PathKind::kSquare, sim::PathKind::kTriangle}) {
    if (!selected(names, std::string(sim::to_string(path)))) continue;
    harness::Cell cell;
    cell.path = path;
    cell.published = harness::published_path_figures(path);
    add_with_errors(cell, errors, cells);
  }
  return cells;
}

std::vector<harness::Cell> density_cells() {
  std::vector<harness::Cell> cells;
  for (const sim::ForestKind forest :
       {sim::ForestKind::kDense, sim::ForestKind::kIntermediate, sim::ForestKind::kSparse}) {
    harness::Cell cell;
    cell.forest = forest;
    cell.published = harness::published_density_figures(forest);
    cells.push_back(cell);
  }
  return cells;
}

/// Those two of the grid that are measured with shared errors as well: that of the paths, and the
/// largest noise.
bool is_measured_with_shared_errors(int sigma_cm, int detection_pct) {
  return (sigma_cm == 20 && detection_pct == 90) || (sigma_cm == 40 && detection_pct == 80);
}

ErrorNames errors_of_cell(const ErrorNames& wanted, int sigma_cm, int detection_pct) {
  ErrorNames errors = wanted;
  if (!is_measured_with_shared_errors(sigma_cm, detection_pct))
    std::erase_if(errors, [](const std::string& one) { return one != "independent"; });
  return errors;
}

std::vector<harness::Cell> noise_cells(const NoiseOptions& options) {
  std::vector<harness::Cell> cells;
  for (const int interval_cm : options.intervals_cm) {
    for (std::size_t row = 0; row < harness::kNoiseSigmas_m.size(); ++row) {
      for (std::size_t column = 0; column < harness::kNoiseDetection.size(); ++column) {
        harness::Cell cell;
        cell.sigma_m = harness::kNoiseSigmas_m[row];
        cell.detection = harness::kNoiseDetection[column];
        cell.interval_m = 0.01 * interval_cm;
        cell.published = harness::PublishedFigures{harness::kPublishedNoiseRpe_cm[row][column],
                                                   harness::kPublishedNoiseLpe_cm[row][column],
                                                   {},
                                                   {}};

        const auto sigma_cm = static_cast<int>(std::lround(100.0 * cell.sigma_m));
        const auto detection_pct = static_cast<int>(std::lround(100.0 * cell.detection));
        if (!selected(options.sigmas_cm, sigma_cm)) continue;
        if (!selected(options.detections_pct, detection_pct)) continue;
        add_with_errors(cell, errors_of_cell(options.errors, sigma_cm, detection_pct), cells);
      }
    }
  }
  return cells;
}

void run_accuracy(const std::string& experiment, const std::vector<harness::Cell>& cells,
                  harness::CampaignOptions options) {
  if (cells.empty()) throw std::runtime_error("no cell has what was asked for");
  const auto lidar =
      std::find(options.methods.begin(), options.methods.end(), harness::kLidarMethod);
  if (lidar != options.methods.end()) options.methods.insert(lidar + 1, harness::kLidarFilter);
  const std::vector<harness::CellResult> results =
      run_campaign(cells, options, terminal::catch_interrupts());
  const std::vector<harness::Summary> rows = summarise(results, options.methods);
  fmt::print("eval {}: {} runs per cell, seed {}; GeoSLAM's published figures on the right\n{}",
             experiment, options.runs, options.seed, to_table(rows));
  if (options.json.empty()) return;
  nlohmann::json json_rows = nlohmann::json::array();
  for (const harness::Summary& row : rows) json_rows.push_back(to_json(row));
  const nlohmann::json config{
      {"runs", options.runs}, {"seed", options.seed}, {"methods", options.methods}};
  harness::write_json(harness::traces_file(options.json), traces_of(results, options));
  harness::write_json(options.json, harness::result_document(experiment, config, json_rows));
  if (options.plots)
    harness::plot("accuracy.py", {options.json, harness::traces_file(options.json).string()});
}

void add_errors_option(CLI::App& command, ErrorNames& errors, const std::string& where) {
  command
      .add_option("--errors", errors,
                  "independent: white noise; shared: of the same power, as measured on a recorded "
                  "walk; shared-wide: the same, stated three times as large" +
                      where)
      ->delimiter(',')
      ->check(CLI::IsMember({"shared", "shared-wide", "independent"}))
      ->capture_default_str();
}

/// The method lidar has the errors of its own sensors.
void check_errors(const ErrorNames& errors, const harness::CampaignOptions& options) {
  const std::vector<std::string>& methods = options.methods;
  const bool are_white =
      std::ranges::all_of(errors, [](const std::string& one) { return one == "independent"; });
  if (!are_white && std::ranges::count(methods, std::string(harness::kLidarMethod)) > 0)
    throw std::runtime_error("--errors shared is of ideal detections, not of the method lidar");
}

}  // namespace

void add_paths_experiment(CLI::App& eval) {
  CLI::App& command =
      *eval.add_subcommand("paths", "Accuracy on GeoSLAM's five paths and the double circle");
  const auto options = std::make_shared<harness::CampaignOptions>();
  const auto paths = std::make_shared<std::vector<std::string>>();
  add_campaign_options_with_lidar(command, *options);
  command.add_option("--path", *paths, "Only these paths")
      ->delimiter(',')
      ->check(
          CLI::IsMember({"circle", "line", "figure-eight", "double-circle", "square", "triangle"}));
  const auto errors = std::make_shared<ErrorNames>(ErrorNames{"independent"});
  add_errors_option(command, *errors, "");
  command.callback([options, paths, errors] {
    run_guarded("paths", [&] {
      check_errors(*errors, *options);
      run_accuracy("paths", path_cells(*paths, *errors), *options);
    });
  });
}

void add_density_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand("density", "Accuracy in three forests");
  const auto options = std::make_shared<harness::CampaignOptions>();
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
  add_errors_option(command, options->errors,
                    "; shared ones in the cells of 20 cm, 90 % and of 40 cm, 80 %");
  command.callback([options] {
    run_guarded("noise", [&] { run_accuracy("noise", noise_cells(*options), options->campaign); });
  });
}

}  // namespace understory::eval::experiments::accuracy
