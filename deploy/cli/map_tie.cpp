#include "deploy/cli/map_tie.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/geometry/alignment.hpp"

namespace understory::cli {
namespace {

/// A heading is weighted by a point this far ahead: 3 mrad there equal 3 cm of position.
constexpr double kAhead_m = 10.0;
/// Largest excess of the median error in the world's own frame over the best fit.
constexpr double kSame_m = 0.1;
/// Least sigma of positions [m].
constexpr double kLeastSigma_m = 0.05;
constexpr int kFitRounds = 50;

std::vector<double> errors_m(const std::vector<MapAndWorldPose>& poses,
                             const geometry::SE2& world_T_map) {
  std::vector<double> errors;
  errors.reserve(poses.size());
  for (const auto& pose : poses) {
    const Eigen::Vector2d off =
        pose.world_T_vehicle.translation() - world_T_map * pose.map_T_vehicle.translation();
    errors.push_back(off.norm());
  }
  return errors;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// One round of the fit: poses are weighted by their variance, and less if their error exceeds it,
/// so that the influence of wrong poses is limited (Huber).
geometry::SE2 refitted(const std::vector<MapAndWorldPose>& poses,
                       const geometry::SE2& world_T_map) {
  const std::vector<double> errors = errors_m(poses, world_T_map);
  const Eigen::Vector2d ahead_m(kAhead_m, 0.0);
  geometry::RigidAlignment2 alignment;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto& [map_T_vehicle, world_T_vehicle, variance_m2] = poses[i];
    const double sigma_m = std::sqrt(variance_m2);
    const double weight = 1.0 / (sigma_m * std::max(sigma_m, errors[i]));
    alignment.add(world_T_vehicle.translation(), map_T_vehicle.translation(), weight);
    alignment.add(world_T_vehicle * ahead_m, map_T_vehicle * ahead_m, weight);
  }
  return alignment.a_T_b();
}

/// Whether the mapper's configuration has a given map; false if it is unreadable.
bool gives_a_map(const config_t& config) {
  try {
    std::istringstream text(config.toml);
    const toml::table table = toml::parse(text);
    return !table["input"]["map_file"].value_or(std::string()).empty();
  } catch (const toml::parse_error&) {
    return false;
  }
}

}  // namespace

const char* to_string(MapTie tie) {
  switch (tie) {
    case MapTie::kFirstMap:
      return "the update that started it";
    case MapTie::kWorld:
      return "its own frame, which is the world's (a given map)";
    case MapTie::kBestFit:
      return "the best fit of all keyframes (a given map, in a frame of its own)";
    case MapTie::kFirstKeyframe:
      return "its oldest keyframe (no update that started it in the log)";
    case MapTie::kFirstUpdate:
      return "the first update in the log (neither its start nor a whole MAP in it)";
  }
  return "?";
}

void MapTies::take(const model::MapUpdate& update) {
  last_map_id_ = update.map_id;
  const Located one{update.utime, update.map_T_vehicle,
                    std::max(kLeastSigma_m * kLeastSigma_m,
                             0.5 * update.covariance.topLeftCorner<2, 2>().trace())};
  if (update.status == model::MapUpdateStatus::kFirstMap) started_.emplace(update.map_id, one);
  if (update.status == model::MapUpdateStatus::kUpdated) located_[update.map_id].push_back(one);
}

void MapTies::take(const config_t& config) {
  if (config.process == "geoslam_mapper") is_given_ = is_given_ || gives_a_map(config);
}

std::optional<TiedMap> MapTies::tie(std::uint32_t map_id, const TruthTrack& truth,
                                    const model::HeldMap& held) const {
  const auto at = [&](const auto& pose, MapTie tie) -> std::optional<TiedMap> {
    const auto true_pose = truth.at(pose.utime);
    if (!true_pose) return std::nullopt;
    return TiedMap{*true_pose * pose.map_T_vehicle.inverse(), tie, true_pose};
  };
  const auto start = started_.find(map_id);
  if (start != started_.end()) {
    if (auto tied = at(start->second, MapTie::kFirstMap)) return tied;
  }

  const auto located = located_.find(map_id);
  const bool is_given = is_given_ && start == started_.end();
  if (is_given && located != located_.end()) {
    std::vector<MapAndWorldPose> poses;
    for (const Located& one : located->second) {
      if (const auto true_pose = truth.at(one.utime))
        poses.push_back({one.map_T_vehicle, *true_pose, one.variance_m2});
    }
    if (!poses.empty()) return fitted_frame(poses);
  }
  if (map_id != last_map_id_) return std::nullopt;

  if (held.has_whole()) {
    const auto whole = held.whole();
    for (const auto& keyframe : whole->keyframes) {
      if (auto tied = at(keyframe, MapTie::kFirstKeyframe)) return tied;
    }
  }
  if (located == located_.end()) return std::nullopt;
  for (const Located& one : located->second) {
    if (auto tied = at(one, MapTie::kFirstUpdate)) return tied;
  }
  return std::nullopt;
}

TiedMap fitted_frame(const std::vector<MapAndWorldPose>& poses) {
  geometry::SE2 world_T_map = poses.front().world_T_vehicle * poses.front().map_T_vehicle.inverse();
  for (int round = 0; round < kFitRounds; ++round) world_T_map = refitted(poses, world_T_map);

  const double best_m = median(errors_m(poses, world_T_map));
  const double as_it_is_m = median(errors_m(poses, {}));
  if (as_it_is_m <= best_m + kSame_m) return {{}, MapTie::kWorld, {}};
  return {world_T_map, MapTie::kBestFit, {}};
}

}  // namespace understory::cli
