#include "services/geoslam_mapper/smoothing/doubles.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Whether nodes observed the two side by side. Two trunks that really are so near to each other
/// are observed together from almost everywhere; one that a bad scan doubled is so once.
bool are_observed_together(const StoredLandmark& a, const StoredLandmark& b) {
  const auto common =
      static_cast<std::size_t>(std::count_if(a.nodes.begin(), a.nodes.end(), [&](NodeIndex node) {
        return std::find(b.nodes.begin(), b.nodes.end(), node) != b.nodes.end();
      }));
  return common > 1 || 4 * common > std::min(a.nodes.size(), b.nodes.size());
}

/// A landmark that is the same as this one.
std::optional<model::LandmarkId> double_of(const StoredLandmark& landmark, double merge_distance_m,
                                           const GlobalMap& map) {
  for (const model::LandmarkId other_id : map.landmarks.index().near(
           {landmark.position_m, merge_distance_m + 2.0 * LandmarkMap::kStaleness_m})) {
    if (other_id == landmark.id) continue;
    const StoredLandmark& other = map.landmarks.at(other_id);
    const double distance = (other.position_m - landmark.position_m).norm();
    if (distance > merge_distance_m || landmark.kind != other.kind ||
        !map.graph.position(landmark.id) || !map.graph.position(other_id) ||
        are_observed_together(landmark, other)) {
      continue;
    }
    return other_id;
  }
  return std::nullopt;
}

void merge(model::LandmarkId old_id, model::LandmarkId new_id,
           const SmoothingMapperParameters& parameters, GlobalMap& map) {
  const StoredLandmark& old_one = map.landmarks.at(old_id);
  StoredLandmark& new_one = map.landmarks.at(new_id);
  const double sigma = std::sqrt(old_one.local_variance() + new_one.local_variance());
  const bool agree = (old_one.position_m - new_one.position_m).norm() <=
                     parameters.gate_sigmas * sigma + parameters.gate_floor_m;
  map.graph.hand_over(old_id, new_id, old_one.nodes, agree);

  // In order of time as far as it is known: the one observed last has the last nodes.
  const StoredLandmark& older = old_one.last_keyframe < new_one.last_keyframe ? old_one : new_one;
  StoredLandmark joined = older;
  for (const NodeIndex node : (&older == &old_one ? new_one : old_one).nodes)
    joined.observed_from(node);
  new_one.nodes = std::move(joined.nodes);
  if (agree) new_one.information += old_one.information;
  new_one.observation_count += old_one.observation_count;
  new_one.last_keyframe = std::max(new_one.last_keyframe, old_one.last_keyframe);
  map.landmarks.remove(old_id);
}

}  // namespace

std::vector<std::pair<model::LandmarkId, model::LandmarkId>> merge_doubles(
    std::span<const model::Association> touched, const SmoothingMapperParameters& parameters,
    GlobalMap& map) {
  std::vector<model::LandmarkId> ids;
  for (const model::Association& pair : touched) ids.push_back(pair.landmark_id);
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());

  std::vector<std::pair<model::LandmarkId, model::LandmarkId>> merged;
  for (const model::LandmarkId id : ids) {
    if (!map.landmarks.all().contains(id)) continue;
    const auto other_id = double_of(map.landmarks.at(id), parameters.merge_distance_m, map);
    if (!other_id) continue;

    const bool keep_first = std::pair(map.landmarks.at(id).observation_count, *other_id) >
                            std::pair(map.landmarks.at(*other_id).observation_count, id);
    const model::LandmarkId keep = keep_first ? id : *other_id;
    const model::LandmarkId drop = keep_first ? *other_id : id;
    merge(drop, keep, parameters, map);
    merged.emplace_back(drop, keep);
  }
  return merged;
}

}  // namespace understory::geoslam_mapper::smoothing
