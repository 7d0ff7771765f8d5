#include "services/viewer/shown_map.hpp"

#include <algorithm>

namespace understory::viewer {

void ShownMap::start(std::uint32_t id) {
  id_ = id;
  version_ = 0;
  landmarks_.clear();
  keyframes_.clear();
  submaps_.clear();
  handed_over_.clear();
  submaps_change_ = ++*changes_;
}

void ShownMap::take(const model::WholeMap& map) {
  if (!map.complete) return;
  version_ = map.version;
  wants_whole_ = false;
  // Landmarks that it does not list, and that were not handed over, were removed.
  std::vector<model::LandmarkId> gone;
  for (const SceneLandmark& one : landmarks_.slots()) {
    if ((one.flags & SceneLandmark::kThere) == 0 || submaps_.holds(one.id)) continue;
    if (!std::ranges::binary_search(map.landmarks, one.id, {}, &model::MapLandmark::id))
      gone.push_back(one.id);
  }
  for (const model::LandmarkId id : gone) landmarks_.remove(id);
  for (const model::MapLandmark& landmark : map.landmarks) {
    submaps_.comes_back(landmark.id);
    landmarks_.set(landmark);
  }
  keyframes_.take(map.keyframes);
}

void ShownMap::take(const model::MapDelta& delta) {
  if (delta.base_version != 0 && delta.version <= version_) return;
  wants_whole_ = delta.base_version != 0 && (wants_whole_ || delta.base_version != version_);
  version_ = delta.version;

  for (const auto* list : {&delta.added, &delta.moved}) {
    for (const model::MapLandmark& landmark : *list) {
      submaps_.comes_back(landmark.id);
      landmarks_.set(landmark);
    }
  }
  for (const model::LandmarkId id : delta.removed) {
    submaps_.comes_back(id);
    landmarks_.remove(id);
  }
  for (const auto& [old_id, new_id] : delta.merged) {
    submaps_.comes_back(old_id);
    landmarks_.remove(old_id);
  }
}

void ShownMap::take(const model::Existence& existence) {
  for (const model::LandmarkExistence& one : existence.landmarks) landmarks_.set_existence(one);
}

void ShownMap::take(const model::Submap& submap) {
  for (const model::MapLandmark& landmark : submaps_.take(submap)) landmarks_.set(landmark);
  for (const model::SubmapId id : submap.replaced) handed_over_.erase(id);
  handed_over_[submap.id] = submap.keyframes;
  submaps_change_ = ++*changes_;
}

void ShownMap::take(const model::MapCorrection& correction) {
  const auto moved = submaps_.take(correction);
  if (moved.empty()) return;
  for (const model::MapLandmark& landmark : moved) landmarks_.set(landmark);
  move_keyframes(correction);
  submaps_change_ = ++*changes_;
}

void ShownMap::move_keyframes(const model::MapCorrection& correction) {
  std::vector<model::KeyframePose> moved;
  for (const model::SubmapPose& pose : correction.submaps) {
    const auto found = handed_over_.find(pose.id);
    if (found == handed_over_.end()) continue;
    for (model::KeyframePose keyframe : found->second) {
      keyframe.map_T_vehicle = pose.map_T_submap * keyframe.map_T_vehicle;
      moved.push_back(keyframe);
    }
  }
  keyframes_.take(moved);
}

void ShownMap::take_stored(std::span<const model::MapLandmark> landmarks,
                           std::span<const model::LandmarkExistence> existence,
                           std::span<const model::KeyframePose> keyframes) {
  keyframes_.take(keyframes);
  for (const model::MapLandmark& landmark : landmarks) landmarks_.set(landmark, true);
  for (const model::LandmarkExistence& one : existence) landmarks_.set_existence(one);
}

std::optional<Eigen::Vector2d> ShownMap::place_of(const model::LoopEnd& end) const {
  if (end.submap != 0) {
    const auto found = submaps_.places().find(end.submap);
    if (found == submaps_.places().end()) return std::nullopt;
    return found->second.map_T_submap.translation();
  }
  const auto pose = keyframes_.find(end.keyframe);
  if (!pose) return std::nullopt;
  return pose->translation();
}

}  // namespace understory::viewer
