// Many runs of several methods on the same drives, side by side.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "eval/harness/published_tables.hpp"
#include "eval/harness/run.hpp"
#include "sim/drive.hpp"

namespace understory::eval::harness {

/// Options that all experiments of simulated drives have in common.
struct CampaignOptions {
  int runs = 10;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;  ///< Where the results go; the plots go beside it. Empty = only the screen.
  std::vector<std::string> methods{"baseline", "smoothing", "oracle"};
  std::string chain_config = "deploy/config/lidar";  ///< Folder; for the method "lidar" alone.
  bool plots = true;
};

/// Errors of detected positions.
enum class Errors : std::uint8_t {
  kIndependent,  ///< White noise.
  /// Correlated along the path and by the direction of view in the proportions measured on a
  /// recorded walk (sim::measured_shared_errors()), of the same power, and all of that stated; the
  /// bias of ranges as measured.
  kShared,
  /// The same, stated with three times the standard deviation: what the mean of a keyframe's scans
  /// keeps of such errors, stated as if each scan had errors of its own.
  kSharedWide,
};
/// "independent", "shared", "shared-wide".
const char* to_string(Errors errors);
/// Of such a name. Throws std::invalid_argument for another one.
Errors errors_named(std::string_view name);

/// One setting of the simulation.
struct Cell {
  sim::ForestKind forest = sim::ForestKind::kIntermediate;
  sim::PathKind path = sim::PathKind::kCircle;
  double sigma_m = 0.2;     ///< Standard deviation of a detected position, per axis.
  double detection = 0.9;   ///< Probability that a trunk in range is detected.
  double interval_m = 0.2;  ///< Between two scans.
  Errors errors = Errors::kIndependent;
  std::optional<PublishedFigures> published;

  /// The parameters of the simulated drive.
  sim::DriveParameters drive() const;
  std::string name() const;  ///< For progress and file names, e.g. circle-intermediate-20cm-90.
};

/// All runs of all methods in one cell.
struct CellResult {
  Cell cell;
  std::map<std::string, std::vector<RunResult>> runs;  ///< By method; [run].
};

/// Runs all cells, `options.jobs` runs at a time. The results do not depend on the number of jobs.
/// Only run 0 keeps its snapshot. Throws Interrupted when `stop` turns true, and
/// std::runtime_error with the name of the run when a method throws.
std::vector<CellResult> run_campaign(const std::vector<Cell>& cells, const CampaignOptions& options,
                                     const std::atomic<bool>& stop);

/// The whole chain from simulated sensors instead of ideal detections, and its filter alone: two
/// rows of one run.
inline constexpr const char* kLidarMethod = "lidar";
inline constexpr const char* kLidarFilter = "lidar-ekf";

/// Seed of a run: the same for every cell and every method.
inline std::uint64_t run_seed(std::uint64_t seed, int run) {
  return (seed << 20) + static_cast<std::uint64_t>(run);
}

}  // namespace understory::eval::harness
