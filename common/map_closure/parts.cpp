#include "common/map_closure/parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

namespace understory::map_closure {
namespace {

using map_file::StoredMap;

/// Longest piece of the ground, along the path [m].
constexpr double kLongestPiece_m = 20.0;
/// Largest distance of a landmark of the ground from a keyframe of its piece [m], if there is one.
constexpr double kInSight_m = 40.0;

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

/// The part of each keyframe and landmark, by indices.
struct Owners {
  std::vector<std::uint32_t> of_keyframe;
  std::vector<std::uint32_t> of_landmark;
};

void give_keyframes(const StoredMap& map, std::span<const model::Submap> submaps,
                    std::vector<Part>& parts, Owners& owners) {
  std::unordered_map<std::uint64_t, std::uint32_t> part_of;
  for (std::uint32_t i = 0; i < submaps.size(); ++i)
    for (const model::KeyframePose& one : submaps[i].keyframes) part_of[one.keyframe_sequence] = i;
  for (std::uint32_t k = 0; k < map.keyframes.size(); ++k) {
    const auto found = part_of.find(map.keyframes[k].keyframe_sequence);
    if (found == part_of.end()) continue;
    owners.of_keyframe[k] = found->second;
    parts[found->second].keyframes.push_back(k);
  }
}

/// The pose in the layers. Other commands may have moved the map since (`map merge`).
geometry::SE2 shown_pose(const StoredMap& map, const model::Submap& submap, const Part& part) {
  if (part.keyframes.empty()) return submap.map_T_submap;
  const model::KeyframePose& middle = map.keyframes[part.keyframes[part.keyframes.size() / 2]];
  const auto inside = std::ranges::find(submap.keyframes, middle.keyframe_sequence,
                                        &model::KeyframePose::keyframe_sequence);
  return middle.map_T_vehicle * inside->map_T_vehicle.inverse();
}

/// A part may have no keyframes because the mapper kept them, e.g. at the map's origin.
model::Utime first_time(const StoredMap& map, const Part& part) {
  if (!part.keyframes.empty()) return map.keyframes[part.keyframes.front()].utime;
  const auto nearest = std::ranges::min_element(map.keyframes, {}, [&](const auto& one) {
    return (one.map_T_vehicle.translation() - part.map_T_part.translation()).squaredNorm();
  });
  return nearest == map.keyframes.end() ? part.utime : nearest->utime;
}

/// Divides the ground outside of submaps, in order of time: a new piece after every gap and every
/// 20 m.
void cut_ground(const StoredMap& map, std::vector<Part>& parts, Owners& owners) {
  double path_m = 0.0;
  bool goes_on = false;
  for (std::uint32_t k = 0; k < map.keyframes.size(); ++k) {
    if (owners.of_keyframe[k] != kNobody) {
      goes_on = false;
      continue;
    }
    const geometry::SE2& pose = map.keyframes[k].map_T_vehicle;
    if (goes_on)
      path_m += (pose.translation() - map.keyframes[k - 1].map_T_vehicle.translation()).norm();
    if (!goes_on || path_m > kLongestPiece_m) {
      parts.push_back({0, true, pose, map.keyframes[k].utime, {}, {}});
      path_m = 0.0;
    }
    goes_on = true;
    owners.of_keyframe[k] = static_cast<std::uint32_t>(parts.size() - 1);
    parts.back().keyframes.push_back(k);
  }
}

/// The part with the nearest keyframe; a part of the ground if one is near enough.
std::uint32_t nearest_part(const StoredMap& map, const std::vector<Part>& parts,
                           const Owners& owners, const Eigen::Vector2d& at) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::uint32_t any = 0;
  std::uint32_t ground = kNobody;
  double any_m = kFar;
  double ground_m = kInSight_m;
  for (std::uint32_t k = 0; k < map.keyframes.size(); ++k) {
    const double distance_m = (map.keyframes[k].map_T_vehicle.translation() - at).norm();
    const std::uint32_t part = owners.of_keyframe[k];
    if (distance_m < any_m) {
      any_m = distance_m;
      any = part;
    }
    if (parts[part].submap == 0 && distance_m < ground_m) {
      ground_m = distance_m;
      ground = part;
    }
  }
  return ground != kNobody ? ground : any;
}

void give_landmarks(const StoredMap& map, std::span<const model::Submap> submaps,
                    std::vector<Part>& parts, Owners& owners) {
  std::unordered_map<model::SubmapId, std::uint32_t> part_of;
  std::unordered_map<model::LandmarkId, std::uint32_t> part_of_landmark;
  for (std::uint32_t i = 0; i < submaps.size(); ++i) {
    part_of[submaps[i].id] = i;
    for (const model::MapLandmark& one : submaps[i].landmarks) part_of_landmark[one.id] = i;
  }

  for (std::uint32_t i = 0; i < map.landmarks.size(); ++i) {
    const map_file::StoredLandmark& one = map.landmarks[i];
    std::optional<std::uint32_t> part;
    if (one.submap_id && part_of.contains(*one.submap_id)) {
      part = part_of.at(*one.submap_id);
      parts[*part].is_held = false;
    }
    if (!part && part_of_landmark.contains(one.landmark.id))
      part = part_of_landmark.at(one.landmark.id);
    owners.of_landmark[i] =
        part ? *part : nearest_part(map, parts, owners, one.landmark.position_m);
  }
  for (std::uint32_t i = 0; i < map.landmarks.size(); ++i)
    parts[owners.of_landmark[i]].landmarks.push_back(i);
}

}  // namespace

std::vector<Part> parts_of(const StoredMap& map, std::span<const model::Submap> submaps) {
  if (submaps.empty())
    throw ClosureError(
        fmt::format("map {} has no submaps: only a drive's file has them", map.map_id));
  std::vector<Part> parts;
  Owners owners{std::vector(map.keyframes.size(), kNobody),
                std::vector(map.landmarks.size(), kNobody)};
  for (const model::Submap& one : submaps)
    parts.push_back({one.id, !one.landmarks.empty(), one.map_T_submap, one.utime, {}, {}});

  give_keyframes(map, submaps, parts, owners);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    parts[i].map_T_part = shown_pose(map, submaps[i], parts[i]);
    parts[i].utime = first_time(map, parts[i]);
  }
  cut_ground(map, parts, owners);
  give_landmarks(map, submaps, parts, owners);
  std::ranges::stable_sort(parts, {}, &Part::utime);
  return parts;
}

}  // namespace understory::map_closure
