#include "services/geoslam_mapper/smoothing/merging.hpp"

#include <algorithm>
#include <utility>

#include "services/geoslam_mapper/smoothing/doubles.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Landmarks, beside those that it observed, around which a keyframe looks for doubles.
constexpr std::size_t kWaitingPerKeyframe = 32;

}  // namespace

MergingResult Merging::follow(const FusedKeyframe& fused,
                              std::span<const model::Association> touched, GlobalMap& map) {
  // What contradicts itself.
  MergingResult result;
  result.separated = merges_.take_back(touched, map);
  if (result.separated && map.graph.solve().ok) map.adopt_estimates();

  // An earlier pass.
  result.merged = pass_joiner_.follow(fused.keyframe.field_of_view, fused.node, merges_, map);
  if (!result.merged.empty()) {
    for (const auto& [id, position_m] : map.graph.moved_landmarks()) waiting_.push_back(id);
  }

  // Single doubles.
  for (const MergedPair& pair : merge_doubles(to_look_at(touched), parameters_, merges_, map))
    result.merged.push_back(pair);
  return result;
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
