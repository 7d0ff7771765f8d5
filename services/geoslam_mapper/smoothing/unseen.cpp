#include "services/geoslam_mapper/smoothing/unseen.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Largest distance of a scan from the keyframe's centre plus that of a landmark from its index
/// position.
constexpr double kViewSlack_m = 5.0;

bool is_of_first_keyframe(const StoredLandmark& landmark) { return landmark.last_keyframe == 1; }

/// A landmark that the node observed and that stays in the map.
std::optional<model::LandmarkId> lasting_of(NodeIndex node, const GlobalMap& map) {
  for (const auto& [id, observation] : map.graph.node(node).observations())
    if (!is_of_first_keyframe(map.landmarks.at(id))) return id;
  return std::nullopt;
}

}  // namespace

std::vector<model::ExpectedLandmark> expected_unseen(
    const model::Keyframe& keyframe, const geometry::SE2& map_T_centre,
    std::span<const model::Association> associations, const LandmarkMap& landmarks) {
  std::vector<model::LandmarkId> seen;
  seen.reserve(associations.size());
  for (const model::Association& pair : associations) seen.push_back(pair.landmark_id);
  std::ranges::sort(seen);

  // With their distances.
  std::vector<std::pair<double, model::LandmarkId>> missed;
  const geometry::SE2 centre_T_map = map_T_centre.inverse();
  const auto is_in_view = [&](const Eigen::Vector2d& position_m) {
    return std::ranges::all_of(keyframe.members, [&](const model::KeyframeMember& member) {
      return keyframe.field_of_view.contains(member.centre_T_vehicle.inverse() * position_m);
    });
  };
  const auto look_for = [&](model::LandmarkId id, const Eigen::Vector2d&, double) {
    if (std::ranges::binary_search(seen, id) || landmarks.is_loose(id)) return;
    const Eigen::Vector2d in_centre = centre_T_map * landmarks.at(id).position_m;
    if (is_in_view(in_centre)) missed.emplace_back(in_centre.norm(), id);
  };
  const double reach_m = keyframe.field_of_view.max_range_m + kViewSlack_m;
  landmarks.index().for_each_within(map_T_centre.translation(), reach_m, look_for);
  landmarks.unused_index().for_each_within(map_T_centre.translation(), reach_m, look_for);

  if (missed.size() > kMostExpected) {
    std::ranges::sort(missed);
    missed.resize(kMostExpected);
  }
  std::vector<model::ExpectedLandmark> result;
  result.reserve(missed.size());
  for (const auto& [distance_m, id] : missed) result.push_back({id});
  std::ranges::sort(result, {}, &model::ExpectedLandmark::id);
  return result;
}

std::vector<model::LandmarkId> drop_unseen(const model::FieldOfView& view, GlobalMap& map) {
  // The poses of all keyframes but the first.
  std::vector<geometry::SE2> vehicles_T_map;
  for (const model::KeyframePose& one : map.all_poses())
    vehicles_T_map.push_back(one.map_T_vehicle.inverse());
  if (vehicles_T_map.size() < 2) return {};
  vehicles_T_map.erase(vehicles_T_map.begin());

  const auto is_unseen = [&](const StoredLandmark& landmark) {
    return is_of_first_keyframe(landmark) && landmark.nodes.size() == 1 &&
           std::ranges::all_of(vehicles_T_map, [&](const geometry::SE2& vehicle_T_map) {
             return view.contains(vehicle_T_map * landmark.position_m);
           });
  };
  std::vector<model::LandmarkId> unseen;
  for (const auto& [id, landmark] : map.landmarks.all())
    if (is_unseen(landmark)) unseen.push_back(id);
  if (unseen.empty()) return unseen;

  // The observations move to a landmark that the node observed, too: there they are ignored.
  const std::vector<NodeIndex> nodes = map.landmarks.at(unseen.front()).nodes;
  const auto lasting = lasting_of(nodes.front(), map);
  if (!lasting) return {};
  for (const model::LandmarkId id : unseen) {
    map.graph.hand_over(id, *lasting, nodes);
    map.landmarks.remove(id);
  }
  map.graph.solve();
  map.adopt_estimates();
  return unseen;
}

}  // namespace understory::geoslam_mapper::smoothing
