// What `understory eval victoria-park` says: table, JSON, picture.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/victoria_park.hpp"

namespace understory::eval {

/// What is compared: ours, dead reckoning alone, the batch solution of the curated graph.
struct TrajectoryRow {
  std::string method;
  FixErrors errors;
  std::optional<TreeScore> trees;
};

struct VictoriaParkReport {
  VictoriaParkRun run;
  std::vector<TrajectoryRow> rows;  ///< rows[0] is ours.
  std::vector<GnssFix> fixes;
};

/// `curated` may be empty, and so may `batch`: the poses of the batch solution.
VictoriaParkReport assess(VictoriaParkRun run, const VictoriaPark& recording,
                          const std::vector<CuratedObservation>& curated,
                          const std::vector<StampedPose>& batch);

/// The batch solution has no stamps. They are found by the length of the path: poses of a car that
/// stood still were removed from it. Reads "pose_id, x_m, y_m, theta_rad" with a heading. Throws
/// DataError.
std::vector<StampedPose> read_batch_solution(const std::filesystem::path& file,
                                             const std::vector<StampedPose>& dead_reckoned);

void print(const VictoriaParkReport& report);
nlohmann::json to_json(const VictoriaParkReport& report);

}  // namespace understory::eval
