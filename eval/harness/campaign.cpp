#include "eval/harness/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "eval/harness/lidar_run.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::harness {
namespace {

/// Of the standard deviation that kSharedWide states.
constexpr double kWide = 3.0;

bool wanted(const CampaignOptions& options, const std::string& method) {
  return std::find(options.methods.begin(), options.methods.end(), method) != options.methods.end();
}

std::map<std::string, RunResult> run_all_methods(const Cell& cell, const CampaignOptions& options,
                                                 int run, const std::atomic<bool>& stop) {
  const RecordedDrive recorded(cell.drive(), run_seed(options.seed, run));
  std::map<std::string, RunResult> results;

  for (const std::string& method : options.methods) {
    if (method == "oracle" || method == kLidarFilter) continue;
    if (method == kLidarMethod) {
      LidarResult lidar =
          run_lidar(recorded.drive, options.chain_config, run_seed(options.seed, run), stop);
      results[method] = std::move(lidar.slam);
      results[kLidarFilter] = std::move(lidar.ekf);
      continue;
    }
    results[method] = run_slam(recorded, make_stages(method), stop);
  }

  if (wanted(options, "oracle")) {
    // The oracle estimates the states of the smoothing method: the ratio compares the same
    // quantities.
    const auto smoothing = results.find("smoothing");
    results["oracle"] = smoothing != results.end() && !smoothing->second.marks.empty()
                            ? run_oracle(recorded, smoothing->second.marks, stop)
                            : run_oracle(recorded, stop);
  }

  for (auto& [method, result] : results) {
    result.marks.clear();
    if (run > 0) result.trace.snapshot.reset();
  }
  return results;
}

/// The power of the independent noise goes to what is measured to be shared.
void share_errors(sim::SensorParameters& sensor) {
  const double scale = sensor.position_sigma_m / sim::measured_sigma_m();
  sensor.shared = sim::measured_shared_errors();
  sensor.shared.along_sigma_m *= scale;
  sensor.shared.direction_sigma_m *= scale;
  sensor.position_sigma_m = scale * sim::kMeasuredIndependentSigmaM;
  sensor.stated_factor = sim::measured_sigma_m() / sim::kMeasuredIndependentSigmaM;
}

}  // namespace

const char* to_string(Errors errors) {
  switch (errors) {
    case Errors::kShared:
      return "shared";
    case Errors::kSharedWide:
      return "shared-wide";
    case Errors::kIndependent:
      break;
  }
  return "independent";
}

Errors errors_named(std::string_view name) {
  for (const Errors one : {Errors::kIndependent, Errors::kShared, Errors::kSharedWide})
    if (name == to_string(one)) return one;
  throw std::invalid_argument(fmt::format("unknown errors '{}'", name));
}

sim::DriveParameters Cell::drive() const {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(forest);
  parameters.path.kind = path;
  parameters.path.interval = interval_m;
  parameters.sensor.position_sigma_m = sigma_m;
  parameters.sensor.detection_probability = detection;
  if (errors != Errors::kIndependent) share_errors(parameters.sensor);
  if (errors == Errors::kSharedWide) parameters.sensor.stated_factor *= kWide;
  return parameters;
}

std::string Cell::name() const {
  return fmt::format("{}-{}-{:.0f}cm-{:.0f}-every{:.0f}cm{}", sim::to_string(path),
                     sim::to_string(forest), 100.0 * sigma_m, 100.0 * detection, 100.0 * interval_m,
                     errors == Errors::kIndependent ? "" : fmt::format("-{}", to_string(errors)));
}

std::vector<CellResult> run_campaign(const std::vector<Cell>& cells, const CampaignOptions& options,
                                     const std::atomic<bool>& stop) {
  std::vector<CellResult> results(cells.size());
  const auto runs = static_cast<std::size_t>(options.runs);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    results[i].cell = cells[i];
    for (const std::string& method : options.methods) results[i].runs[method].resize(runs);
  }
  tools::run_in_parallel(cells.size() * runs, options.jobs, "runs", stop, [&](std::size_t job) {
    const Cell& cell = cells[job / runs];
    const auto run = static_cast<int>(job % runs);
    try {
      for (auto& [method, result] : run_all_methods(cell, options, run, stop)) {
        results[job / runs].runs.at(method)[run] = std::move(result);
      }
    } catch (const std::exception& error) {
      throw std::runtime_error(
          fmt::format("{} run {} (seed {}): {}", cell.name(), run, options.seed, error.what()));
    }
  });
  return results;
}

}  // namespace understory::eval::harness
