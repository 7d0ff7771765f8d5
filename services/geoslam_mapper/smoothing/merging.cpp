#include "services/geoslam_mapper/smoothing/merging.hpp"

#include <algorithm>
#include <utility>

#include "services/geoslam_mapper/smoothing/doubles.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Most landmarks, beside the observed ones, around which one keyframe searches for doubles.
constexpr std::size_t kWaitingPerKeyframe = 32;

/// Those of these landmarks that are dormant, and dormant ones that may be the same landmark.
std::vector<model::LandmarkId> with_neighbours(std::span<const model::LandmarkId> ids,
                                               double distance_m, const GlobalMap& map) {
  std::vector<model::LandmarkId> result;
  for (const model::LandmarkId id : ids) {
    if (!map.graph.is_dormant(id)) continue;
    const auto near = map.landmarks.index().near(
        {map.landmarks.at(id).position_m, distance_m + 2.0 * LandmarkMap::kStaleness_m});
    result.insert(result.end(), near.begin(), near.end());
  }
  return result;
}

/// Landmarks of the given map that may be the same as these and are not in the graph yet.
std::vector<model::LandmarkId> given_beside(std::span<const model::LandmarkId> ids,
                                            double distance_m, const GlobalMap& map) {
  if (!map.landmarks.has_given()) return {};
  std::vector<model::LandmarkId> result;
  for (const model::LandmarkId id : ids) {
    if (!map.landmarks.all().contains(id) || map.landmarks.at(id).is_given()) continue;
    for (const model::LandmarkId other : map.landmarks.index().near(
             {map.landmarks.at(id).position_m, distance_m + 2.0 * LandmarkMap::kStaleness_m})) {
      if (map.landmarks.at(other).is_given_unseen() && !map.graph.position(other))
        result.push_back(other);
    }
  }
  return result;
}

/// Adds them to the solved graph.
void enter(std::span<const model::LandmarkId> given, GlobalMap& map) {
  if (given.empty()) return;
  map.graph.checkpoint();
  for (const model::LandmarkId id : given) map.enter_given(id);
  (void)map.graph.solve();  // Moves nothing: no keyframe observed them.
  map.adopt_estimates();
}

}  // namespace

MergingResult Merging::follow(const FusedKeyframe& fused,
                              std::span<const model::Association> touched, GlobalMap& map) {
  // Separates contradicting landmarks.
  MergingResult result;
  result.separated = merges_.take_back(touched, map);
  if (result.separated && map.graph.solve().ok) map.adopt_estimates();

  // Joins an earlier pass.
  JoinedPasses joined = pass_joiner_.follow(fused.keyframe.field_of_view, fused.node, merges_, map);
  result.merged = std::move(joined.pairs);
  waiting_.insert(waiting_.end(), joined.moved.begin(), joined.moved.end());

  // Merges single doubles.
  const std::vector<model::LandmarkId> ids = to_look_at(touched);
  map.wake(with_neighbours(ids, parameters_.merge_distance_m, map));
  enter(given_beside(ids, parameters_.merge_distance_m, map), map);
  for (const MergedPair& pair : merge_doubles(ids, parameters_, merges_, map))
    result.merged.push_back(pair);
  return result;
}

std::vector<MergedPair> Merging::join(std::vector<MergedPair> pairs, GlobalMap& map) {
  JoinedPasses joined = pass_joiner_.join(std::move(pairs), merges_, map);
  waiting_.insert(waiting_.end(), joined.moved.begin(), joined.moved.end());
  return std::move(joined.pairs);
}

std::vector<model::LandmarkId> Merging::to_look_at(std::span<const model::Association> touched) {
  std::vector<model::LandmarkId> ids;
  for (const model::Association& pair : touched) ids.push_back(pair.landmark_id);
  const std::size_t count = std::min(kWaitingPerKeyframe, waiting_.size());
  ids.insert(ids.end(), waiting_.end() - static_cast<std::ptrdiff_t>(count), waiting_.end());
  waiting_.resize(waiting_.size() - count);

  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace understory::geoslam_mapper::smoothing
