// `understory log accuracy`: a recorded run against the ground truth recorded beside it.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/io/output_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/drive_accuracy.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_commands.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

std::uint64_t count_of(const DriveAccuracy& accuracy, model::MapUpdateStatus status) {
  const auto found = accuracy.updates.find(status);
  return found == accuracy.updates.end() ? 0 : found->second;
}

/// Messages that the processes report as missing.
struct Drops {
  std::int64_t lost = 0;
  std::int64_t malformed = 0;
  std::int64_t dropped = 0;
};

Drops drops_of(const DriveAccuracy& accuracy) {
  Drops drops;
  for (const auto& [process, health] : accuracy.last_health) {
    for (const auto& channel : health.channels) {
      if (channel.output != 0) continue;
      drops.lost += channel.lost;
      drops.malformed += channel.malformed;
      drops.dropped += channel.dropped;
    }
  }
  return drops;
}

nlohmann::ordered_json summary(const DriveAccuracy& accuracy) {
  const auto live = position_errors_m(accuracy.live);
  const auto keyframes = position_errors_m(accuracy.keyframes);
  const auto drops = drops_of(accuracy);

  return {{"scans", accuracy.scans},
          {"live_poses", live.size()},
          {"live_mean_cm", 100.0 * mean(live)},
          {"live_rmse_cm", 100.0 * rms(live)},
          {"live_max_cm", 100.0 * maximum(live)},
          {"keyframes", keyframes.size()},
          {"rpe_cm", 100.0 * mean(keyframes)},
          {"landmarks", accuracy.landmarks_m.size()},
          {"lpe_cm", 100.0 * mean(accuracy.landmark_errors_m)},
          {"updates", count_of(accuracy, model::MapUpdateStatus::kFirstMap) +
                          count_of(accuracy, model::MapUpdateStatus::kUpdated)},
          {"updates_not_sure", count_of(accuracy, model::MapUpdateStatus::kNotSure)},
          {"updates_rolled_back", count_of(accuracy, model::MapUpdateStatus::kRolledBack)},
          {"lost", drops.lost},
          {"malformed", drops.malformed},
          {"dropped", drops.dropped},
          {"lost_by_the_log", accuracy.log_lost},
          {"map_tied_at", to_string(accuracy.tied_at)}};
}

nlohmann::ordered_json poses_json(const std::vector<ComparedPose>& poses) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& pose : poses) {
    list.push_back({1e-6 * static_cast<double>(pose.utime), pose.world_T_vehicle.x(),
                    pose.world_T_vehicle.y(), pose.true_world_T_vehicle.x(),
                    pose.true_world_T_vehicle.y(), pose.position_error_m()});
  }
  return list;
}

nlohmann::ordered_json points_json(const std::vector<Eigen::Vector2d>& points) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& point : points) list.push_back({point.x(), point.y()});
  return list;
}

void print_table(const nlohmann::ordered_json& s) {
  const auto number = [&](const char* key) { return s[key].get<double>(); };
  const auto count = [&](const char* key) { return s[key].get<std::int64_t>(); };
  fmt::print("{:<34} {}\n", "scans in the log", count("scans"));
  fmt::print("{:<34} {} (not sure {}, rolled back {})\n", "map updates", count("updates"),
             count("updates_not_sure"), count("updates_rolled_back"));
  fmt::print("{:<34} mean {:.1f} cm, rms {:.1f} cm, largest {:.1f} cm, of {} poses\n",
             "position as published live", number("live_mean_cm"), number("live_rmse_cm"),
             number("live_max_cm"), count("live_poses"));
  fmt::print("{:<34} mean {:.1f} cm, of {}\n", "keyframes in the final map", number("rpe_cm"),
             count("keyframes"));
  fmt::print("{:<34} mean {:.1f} cm, of {}\n", "landmarks in the final map", number("lpe_cm"),
             count("landmarks"));

  fmt::print("{:<34} {}\n", "the map is tied to the world at", s["map_tied_at"].get<std::string>());
  fmt::print("{:<34} lost {}, malformed {}, dropped {} (and {} by the recorder)\n",
             "messages that did not arrive", count("lost"), count("malformed"), count("dropped"),
             count("lost_by_the_log"));
}

void write_series(const std::string& file, nlohmann::ordered_json json,
                  const DriveAccuracy& accuracy) {
  json["pose_columns"] = {"time_s", "x_m", "y_m", "true_x_m", "true_y_m", "error_m"};
  json["live"] = poses_json(accuracy.live);
  json["map_keyframes"] = poses_json(accuracy.keyframes);
  json["map_landmarks_m"] = points_json(accuracy.landmarks_m);
  json["true_landmarks_m"] = points_json(accuracy.true_landmarks_m);
  write_text_file(file, dumped(json, -1) + "\n");
}

}  // namespace

void log_accuracy(const std::string& file, const std::string& json_file) {
  if (!json_file.empty() && io::is_same_file(file, json_file)) {
    wrong_usage(fmt::format("--json {}: is the log itself", json_file));
  }

  io::LcmLogReader reader(file);
  DriveAccuracyCollector collector;
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

  const auto json = summary(*accuracy);
  print_table(json);
  if (!json_file.empty()) write_series(json_file, json, *accuracy);
}

}  // namespace understory::cli
