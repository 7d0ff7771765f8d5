#include "eval/experiments/victoria_park/victoria_park_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::victoria_park {
namespace {

/// Path length of `point` (frame `vehicle`) up to each pose [m].
std::vector<double> lengths(const std::vector<metrics::StampedPose>& path,
                            const Eigen::Vector2d& point) {
  std::vector<double> sums{0.0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    sums.push_back(sums.back() + (path[i].pose * point - path[i - 1].pose * point).norm());
  }
  return sums;
}

std::size_t count(const VictoriaParkRun& run, model::MapUpdateStatus status) {
  return static_cast<std::size_t>(
      std::ranges::count(run.updates, status, &model::MapUpdate::status));
}

double total_ms(const VictoriaParkRun& run, std::size_t scan) {
  return 1e3 *
         (run.times.extractor_s[scan] + run.times.keyframer_s[scan] + run.times.mapper_s[scan]);
}

std::vector<double> scan_times_ms(const VictoriaParkRun& run) {
  std::vector<double> times;
  for (std::size_t i = 0; i < run.times.mapper_s.size(); ++i) times.push_back(total_ms(run, i));
  return times;
}

/// Longest time between two localised keyframes [s].
double longest_gap_s(const std::vector<metrics::StampedPose>& live) {
  model::Utime longest = 0;
  for (std::size_t i = 1; i < live.size(); ++i) {
    longest = std::max(longest, live[i].utime - live[i - 1].utime);
  }
  return static_cast<double>(longest) * 1e-6;
}

nlohmann::json to_json(const metrics::StampedPose& pose) {
  return {static_cast<double>(pose.utime) * 1e-6, pose.pose.x(), pose.pose.y(), pose.pose.theta()};
}

nlohmann::json trees_json(const metrics::TreeScore& score) {
  nlohmann::json list = nlohmann::json::array();
  for (const metrics::CuratedTree& tree : score.trees) {
    list.push_back({{"id", tree.id},
                    {"x_m", tree.position_m.x()},
                    {"y_m", tree.position_m.y()},
                    {"spread_m", tree.spread_m},
                    {"observations", tree.observations},
                    {"found", tree.landmark != 0},
                    {"doubles", tree.doubles},
                    {"distance_m", tree.distance_m}});
  }
  return list;
}

nlohmann::json row_json(const TrajectoryRow& row) {
  nlohmann::json json = {{"method", row.method},
                         {"fix_median_m", row.errors.at_time_median_m},
                         {"fix_p90_m", row.errors.at_time_p90_m},
                         {"path_median_m", row.errors.to_path_median_m},
                         {"path_p90_m", row.errors.to_path_p90_m}};
  if (row.trees) {
    json["trees"] = row.trees->well_seen;
    json["trees_found"] = row.trees->found;
    json["trees_doubled"] = row.trees->doubled;
    json["landmarks_elsewhere"] = row.trees->landmarks_elsewhere;
    json["tree_spread_median_m"] = row.trees->median_spread_m;
    json["tree_distance_median_m"] = row.trees->median_distance_m;
  }
  return json;
}

void add_run(const VictoriaParkRun& run, nlohmann::json& row) {
  row["keyframes"] = run.updates.size();
  row["keyframes_withheld"] = run.keyframes_withheld;
  row["updates"] = count(run, model::MapUpdateStatus::kUpdated);
  row["not_sure"] = count(run, model::MapUpdateStatus::kNotSure);
  row["rolled_back"] = count(run, model::MapUpdateStatus::kRolledBack);
  row["landmarks"] = run.landmarks.size();
  row["longest_gap_s"] = longest_gap_s(run.live);
  const std::vector<double> times = scan_times_ms(run);
  row["ms_p50"] = tools::quantile(times, 0.5);
  row["ms_p99"] = tools::quantile(times, 0.99);
  row["ms_max"] = tools::quantile(times, 1.0);
  row["extractor_ms_p50"] = 1e3 * tools::quantile(run.times.extractor_s, 0.5);
  row["extractor_ms_p99"] = 1e3 * tools::quantile(run.times.extractor_s, 0.99);
}

template <class Values, class Convert>
nlohmann::json array_of(const Values& values, Convert&& convert) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& value : values) list.push_back(convert(value));
  return list;
}

}  // namespace

VictoriaParkReport assess(VictoriaParkRun run, const io::VictoriaPark& recording,
                          const std::vector<metrics::CuratedObservation>& curated,
                          const std::vector<metrics::StampedPose>& batch) {
  VictoriaParkReport report;
  report.fixes = recording.gnss;
  TrajectoryRow smoothing{"smoothing", against_fixes(run.trajectory, recording.gnss), std::nullopt};
  if (!curated.empty()) smoothing.trees = against_trees(run.trajectory, curated, run.landmarks);
  report.rows.push_back(std::move(smoothing));
  report.rows.push_back(
      {"smoothing, as published live", against_fixes(run.live, recording.gnss), std::nullopt});
  report.rows.push_back(
      {"dead reckoning", against_fixes(run.dead_reckoned, recording.gnss), std::nullopt});
  if (!batch.empty()) {
    report.rows.push_back(
        {"batch, curated graph", against_fixes(batch, recording.gnss), std::nullopt});
  }
  report.run = std::move(run);
  return report;
}

std::vector<metrics::StampedPose> read_batch_solution(
    const std::filesystem::path& file, const std::vector<metrics::StampedPose>& dead_reckoned) {
  const io::RecordingFolder folder(file.parent_path());
  const std::string text = folder.read(file.filename().string());
  io::NumberReader reader(text, file.string());
  reader.skip_line();

  std::vector<metrics::StampedPose> poses;
  while (reader.next()) {
    const double x = reader.require("x [m]");
    const double y = reader.require("y [m]");
    poses.push_back({0, geometry::SE2(x, y, reader.require("the heading [rad]"))});
  }

  // Its poses are those of the rear axle.
  const Eigen::Vector2d axle = io::victoria_park::axle_T_vehicle().inverse().translation();
  const std::vector<double> driven = lengths(poses, {0.0, 0.0});
  const std::vector<double> reckoned_path = lengths(dead_reckoned, axle);
  const double scale = driven.back() > 0.0 ? reckoned_path.back() / driven.back() : 1.0;

  // Each pose takes the time at which dead reckoning came as far.
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto at = std::ranges::lower_bound(reckoned_path, driven[i] * scale);
    const auto index =
        std::min<std::ptrdiff_t>(at - reckoned_path.begin(), std::ssize(dead_reckoned) - 1);
    poses[i].utime = dead_reckoned[static_cast<std::size_t>(index)].utime;
  }
  return poses;
}

void print(const VictoriaParkReport& report) {
  fmt::print("{:<22}{:>12}{:>10}{:>14}{:>10}\n", "method", "fix median", "90 %", "path median",
             "90 %");
  for (const TrajectoryRow& row : report.rows) {
    fmt::print("{:<22}{:>10.2f} m{:>8.2f} m{:>12.2f} m{:>8.2f} m\n", row.method,
               row.errors.at_time_median_m, row.errors.at_time_p90_m, row.errors.to_path_median_m,
               row.errors.to_path_p90_m);
  }

  fmt::print(
      "fix: distance of a GPS fix from the pose at its time; path: from the nearest point of the\n"
      "path (the batch solution has no stamps of its own). After one rigid alignment.\n\n");
  const VictoriaParkRun& run = report.run;

  fmt::print(
      "{} keyframes: {} localised, {} not sure, {} rolled back; {} withheld; longest gap {:.1f} "
      "s\n",
      run.updates.size(), run.live.size(), count(run, model::MapUpdateStatus::kNotSure),
      count(run, model::MapUpdateStatus::kRolledBack), run.keyframes_withheld,

      longest_gap_s(run.live));
  fmt::print("{} landmarks", run.landmarks.size());
  if (const auto& trees = report.rows.front().trees) {
    fmt::print(
        "; of {} curated trees {} found, {} doubled; {} landmarks elsewhere;\n"
        "observations of a tree spread by {:.2f} m (median), its landmark is {:.2f} m off",
        trees->well_seen, trees->found, trees->doubled, trees->landmarks_elsewhere,
        trees->median_spread_m, trees->median_distance_m);
  }

  const std::vector<double> times = scan_times_ms(run);
  fmt::print("\ntime per scan: {:.3f} ms median, {:.2f} ms p99, {:.2f} ms max\n",
             tools::quantile(times, 0.5), tools::quantile(times, 0.99),
             tools::quantile(times, 1.0));
}

nlohmann::json to_json(const VictoriaParkReport& report) {
  const VictoriaParkRun& run = report.run;
  nlohmann::json json;
  json["rows"] = array_of(report.rows, row_json);
  add_run(run, json["rows"][0]);

  const geometry::SE2& world_T_map = report.rows.front().errors.world_T_map;
  json["world_T_map"] = {world_T_map.x(), world_T_map.y(), world_T_map.theta()};
  const auto pose = [](const metrics::StampedPose& value) { return to_json(value); };
  json["trajectory"] = array_of(run.trajectory, pose);
  json["published"] = array_of(run.live, pose);

  json["dead_reckoned"] = array_of(run.dead_reckoned, pose);
  json["landmarks"] = array_of(run.landmarks, [](const model::MapLandmark& landmark) {
    return nlohmann::json{landmark.position_m.x(), landmark.position_m.y(), landmark.radius_m,
                          landmark.observation_count};
  });
  json["fixes"] = array_of(report.fixes, [](const model::GnssFix& fix) {
    return nlohmann::json{static_cast<double>(fix.utime) * 1e-6, fix.east_north_m.x(),
                          fix.east_north_m.y()};
  });

  if (report.rows.front().trees) json["trees"] = trees_json(*report.rows.front().trees);
  json["updates"] = array_of(run.updates, [](const model::MapUpdate& update) {
    return nlohmann::json{{"t_s", static_cast<double>(update.utime) * 1e-6},

                          {"status", static_cast<int>(update.status)},
                          {"prior", update.used_prior},
                          {"inliers", update.inliers},
                          {"added", update.added.size()},
                          {"chi2", update.chi2},
                          {"dof", update.degrees_of_freedom},
                          {"reason", update.reason}};
  });
  json["scan_ms"] = scan_times_ms(run);
  return json;
}

}  // namespace understory::eval::experiments::victoria_park
