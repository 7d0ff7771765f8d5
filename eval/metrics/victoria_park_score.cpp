#include "eval/metrics/victoria_park_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

#include "common/geometry/alignment.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::metrics {
namespace {

double part_of(model::Utime from, model::Utime to, model::Utime at) {
  return to == from ? 0.0 : static_cast<double>(at - from) / static_cast<double>(to - from);
}

double distance_to_segment(const Eigen::Vector2d& point, const Eigen::Vector2d& a,
                           const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((point - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (point - a - t * along).norm();
}

double distance_to_path(std::span<const StampedPose> path, const Eigen::Vector2d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < path.size(); ++i) {
    least = std::min(least, distance_to_segment(point, path[i - 1].pose.translation(),
                                                path[i].pose.translation()));
  }
  return least;
}

}  // namespace

bool localised(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

std::optional<geometry::SE2> pose_at(std::span<const StampedPose> trajectory, model::Utime utime) {
  const auto after = std::ranges::lower_bound(trajectory, utime, {}, &StampedPose::utime);
  if (after == trajectory.end()) return std::nullopt;
  if (after->utime == utime) return after->pose;
  if (after == trajectory.begin()) return std::nullopt;
  const StampedPose& before = *std::prev(after);
  const Eigen::Vector3d motion = (before.pose.inverse() * after->pose).Log();
  return before.pose * geometry::SE2::Exp(part_of(before.utime, after->utime, utime) * motion);
}

std::vector<StampedPose> fill_between(std::span<const StampedPose> known,
                                      std::span<const StampedPose> dead_reckoned) {
  std::vector<StampedPose> filled;
  std::size_t next = 0;  // First known pose after the stamp.
  for (const StampedPose& reckoned : dead_reckoned) {
    while (next < known.size() && known[next].utime <= reckoned.utime) ++next;
    if (next == 0) continue;
    const StampedPose& before = known[next - 1];
    const auto reckoned_before = pose_at(dead_reckoned, before.utime);
    if (!reckoned_before) continue;
    geometry::SE2 pose = before.pose * (reckoned_before->inverse() * reckoned.pose);
    if (next < known.size()) {
      const StampedPose& after = known[next];
      const auto reckoned_after = pose_at(dead_reckoned, after.utime);
      if (reckoned_after) {
        const geometry::SE2 predicted =
            before.pose * (reckoned_before->inverse() * *reckoned_after);
        const Eigen::Vector3d correction = (predicted.inverse() * after.pose).Log();
        pose = pose *
               geometry::SE2::Exp(part_of(before.utime, after.utime, reckoned.utime) * correction);
      }
    }
    filled.push_back({reckoned.utime, pose});
  }
  return filled;
}

FixErrors against_fixes(std::span<const StampedPose> trajectory,
                        std::span<const model::GnssFix> fixes, const Eigen::Vector2d& antenna_m) {
  std::vector<StampedPose> antenna(trajectory.begin(), trajectory.end());
  for (StampedPose& one : antenna) one.pose = one.pose * geometry::SE2(antenna_m, 0.0);

  std::vector<Eigen::Vector2d> world;
  std::vector<Eigen::Vector2d> map;
  for (const model::GnssFix& fix : fixes) {
    const auto pose = pose_at(antenna, fix.utime);
    if (!pose) continue;
    world.push_back(fix.east_north_m);
    map.push_back(pose->translation());
  }
  FixErrors errors;
  if (map.size() < 2) return errors;
  errors.world_T_map = geometry::align_rigid(world, map);
  const geometry::SE2 map_T_world = errors.world_T_map.inverse();
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector2d fix = map_T_world * world[i];
    errors.at_time_m.push_back((fix - map[i]).norm());
    errors.to_path_m.push_back(distance_to_path(antenna, fix));
  }
  errors.at_time_median_m = tools::quantile(errors.at_time_m, 0.5);
  errors.at_time_p90_m = tools::quantile(errors.at_time_m, 0.9);
  errors.to_path_median_m = tools::quantile(errors.to_path_m, 0.5);
  errors.to_path_p90_m = tools::quantile(errors.to_path_m, 0.9);
  return errors;
}

std::vector<CuratedObservation> read_curated_observations(const std::filesystem::path& file) {
  const io::RecordingFolder folder(file.parent_path());
  const std::string text = folder.read(file.filename().string());
  io::NumberReader reader(text, file.string());
  reader.skip_line();
  std::vector<CuratedObservation> observations;
  while (const auto seconds = reader.next()) {
    const double range = reader.require("the range [m]");
    const double from_right = reader.require("the bearing [rad]");
    const double tree = reader.require("the tree's id");
    observations.push_back({static_cast<model::Utime>(std::llround(*seconds * 1e6)),
                            range * Eigen::Vector2d(std::sin(from_right), -std::cos(from_right)),
                            static_cast<int>(std::lround(tree))});
  }
  return observations;
}

namespace {

/// Places each tree by the mean of its observations.
std::vector<CuratedTree> place_trees(std::span<const StampedPose> trajectory,
                                     std::span<const CuratedObservation> observations) {
  std::map<int, std::vector<Eigen::Vector2d>> placed;
  for (const CuratedObservation& observation : observations) {
    const auto pose = pose_at(trajectory, observation.utime);
    if (pose) placed[observation.tree].push_back(*pose * observation.position_m);
  }
  std::vector<CuratedTree> trees;
  for (const auto& [id, points] : placed) {
    CuratedTree tree;
    tree.id = id;
    tree.observations = points.size();
    tree.position_m = std::accumulate(points.begin(), points.end(), Eigen::Vector2d(0.0, 0.0)) /
                      static_cast<double>(points.size());
    double sum = 0.0;
    for (const auto& point : points) sum += (point - tree.position_m).squaredNorm();
    tree.spread_m = std::sqrt(sum / static_cast<double>(points.size()));
    trees.push_back(tree);
  }
  return trees;
}

struct Pair {
  double distance_m = 0.0;
  std::size_t tree = 0;
  std::size_t landmark = 0;
};

std::vector<Pair> near_pairs(std::span<const CuratedTree> trees,
                             std::span<const model::MapLandmark> landmarks, double radius_m) {
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      const double distance = (trees[t].position_m - landmarks[l].position_m).norm();
      if (distance <= radius_m) pairs.push_back({distance, t, l});
    }
  }
  std::ranges::sort(pairs, {}, [](const Pair& pair) {
    return std::tuple(pair.distance_m, pair.tree, pair.landmark);
  });
  return pairs;
}

}  // namespace

TreeScore against_trees(std::span<const StampedPose> trajectory,
                        std::span<const CuratedObservation> observations,
                        std::span<const model::MapLandmark> landmarks, double radius_m,
                        std::size_t min_observations) {
  TreeScore score;
  score.trees = place_trees(trajectory, observations);
  const std::vector<Pair> pairs = near_pairs(score.trees, landmarks, radius_m);
  std::vector<bool> taken(landmarks.size(), false);
  std::vector<double> distances;
  for (const Pair& pair : pairs) {
    CuratedTree& tree = score.trees[pair.tree];
    if (taken[pair.landmark] || tree.landmark != 0) continue;
    taken[pair.landmark] = true;
    tree.landmark = landmarks[pair.landmark].id;
    tree.distance_m = pair.distance_m;
    distances.push_back(pair.distance_m);
  }
  for (const Pair& pair : pairs) {
    if (taken[pair.landmark]) continue;
    taken[pair.landmark] = true;
    ++score.trees[pair.tree].doubles;
  }
  std::vector<double> spreads;
  for (const CuratedTree& tree : score.trees) {
    if (tree.observations < min_observations) continue;
    ++score.well_seen;
    if (tree.landmark != 0) ++score.found;
    if (tree.doubles > 0) ++score.doubled;
    spreads.push_back(tree.spread_m);
  }
  score.landmarks_elsewhere =
      static_cast<std::size_t>(std::count(taken.begin(), taken.end(), false));
  score.median_spread_m = tools::quantile(spreads, 0.5);
  score.median_distance_m = tools::quantile(distances, 0.5);
  return score;
}

}  // namespace understory::eval::metrics
