// What `understory eval victoria-park` reports: table and JSON.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/experiments/victoria_park/victoria_park.hpp"

namespace understory::eval::experiments::victoria_park {

/// What is compared: the smoothing mapper, dead reckoning alone, the batch solution of the curated
/// graph.
struct TrajectoryRow {
  std::string method;
  metrics::FixErrors errors;
  std::optional<metrics::TreeScore> trees;
};

/// A run and its errors.
struct VictoriaParkReport {
  VictoriaParkRun run;
  std::vector<TrajectoryRow> rows;  ///< rows[0] is the smoothing mapper.
  std::vector<model::GnssFix> fixes;
};

/// `curated` may be empty, and so may `batch`: the poses of the batch solution.
VictoriaParkReport assess(VictoriaParkRun run, const io::VictoriaPark& recording,
                          const std::vector<metrics::CuratedObservation>& curated,
                          const std::vector<metrics::StampedPose>& batch);

/// The batch solution has no stamps. They are found by the length of the path: poses of the
/// stationary car were removed from it. Reads "pose_id, x_m, y_m, theta_rad" with a heading. Throws
/// DataError.
std::vector<metrics::StampedPose> read_batch_solution(
    const std::filesystem::path& file, const std::vector<metrics::StampedPose>& dead_reckoned);

/// Prints the table to stdout.
void print(const VictoriaParkReport& report);
/// The result document's rows, with trajectories, map, fixes and trees for the plot.
nlohmann::json to_json(const VictoriaParkReport& report);

}  // namespace understory::eval::experiments::victoria_park
