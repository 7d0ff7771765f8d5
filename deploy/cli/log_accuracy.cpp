// `understory log accuracy`: a recorded run against the ground truth in its log.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "common/io/output_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/accuracy_report.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_commands.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

/// One row for each pose; see `pose_columns`.
nlohmann::ordered_json poses_json(const std::vector<ComparedPose>& poses) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& pose : poses) {
    const auto nees = nees_of({pose});
    list.push_back({1e-6 * static_cast<double>(pose.utime), pose.world_T_vehicle.x(),
                    pose.world_T_vehicle.y(), pose.true_world_T_vehicle.x(),
                    pose.true_world_T_vehicle.y(), pose.position_error_m(),
                    pose.world_T_vehicle.theta(), pose.true_world_T_vehicle.theta(), pose.map_id});
    list.back().push_back(nees.empty() ? nlohmann::ordered_json()
                                       : nlohmann::ordered_json(nees[0]));
  }
  return list;
}

nlohmann::ordered_json points_json(const std::vector<Eigen::Vector2d>& points) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& point : points) list.push_back({point.x(), point.y()});
  return list;
}

void write_series(const std::string& file, nlohmann::ordered_json json,
                  const DriveAccuracy& accuracy) {
  json["pose_columns"] = {"time_s",   "x_m",     "y_m",         "true_x_m",
                          "true_y_m", "error_m", "heading_rad", "true_heading_rad",
                          "map_id",   "nees"};
  json["live"] = poses_json(accuracy.live);
  json["map_keyframes"] = poses_json(accuracy.keyframes);
  json["map_landmarks_m"] = points_json(accuracy.landmarks.landmarks_m);
  json["true_landmarks_m"] = points_json(accuracy.landmarks.true_landmarks_m);
  write_text_file(file, result_text(json, -1) + "\n");
}

}  // namespace

void log_accuracy(const std::string& file, const AccuracyOptions& options) {
  const std::string& json_file = options.json_file;
  if (!json_file.empty() && io::is_same_file(file, json_file)) {
    wrong_usage(fmt::format("--json {}: is the log itself", json_file));
  }

  io::LcmLogReader reader(file);
  const double truth_sigma_rad = options.truth_sigma_deg * std::numbers::pi / 180.0;
  DriveAccuracyCollector collector({options.truth_sigma_m, truth_sigma_rad});
  terminal::Progress progress("reading " + file, static_cast<double>(reader.size_bytes()));

  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    collector.add(*event);
    progress.update(static_cast<double>(reader.position_bytes()));
  }

  reader.refuse_other_files();
  const auto accuracy = collector.finish();
  if (!accuracy) {
    fail(fmt::format(
        "{}: no GROUND_TRUTH at the time of a SLAM_UPDATE or of a keyframe of MAP in it", file));
  }

  const auto json = accuracy_summary(*accuracy);
  print_accuracy(json);
  if (!json_file.empty()) write_series(json_file, json, *accuracy);
}

}  // namespace understory::cli
