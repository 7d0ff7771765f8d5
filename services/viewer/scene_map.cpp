#include "services/viewer/scene.hpp"

#include <algorithm>

namespace understory::viewer {
namespace {

constexpr std::size_t kMostClosures = 20'000;

const char* result_text(model::LoopResult::Status status) {
  switch (status) {
    case model::LoopResult::Status::kAccepted:
      return "accepted";
    case model::LoopResult::Status::kWaiting:
      return "waiting";
    case model::LoopResult::Status::kRefused:
      return "refused";
    case model::LoopResult::Status::kRevoked:
      return "revoked";
  }
  return "sent";
}

}  // namespace

void Scene::take(const model::WholeMap& map) {
  utime_ = std::max(utime_, map.utime);
  if (!map.complete) return;
  map_version_ = map.version;
  wants_map_ = false;
  // What it does not list, and was not handed over, is gone.
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

void Scene::take(const model::MapDelta& delta) {
  utime_ = std::max(utime_, delta.utime);
  if (delta.base_version == 0 && map_version_ != 0) start_map(map_id_);
  if (delta.base_version != 0 && delta.version <= map_version_) return;
  wants_map_ = delta.base_version != 0 && (wants_map_ || delta.base_version != map_version_);
  map_version_ = delta.version;

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

void Scene::take(const model::Existence& existence) {
  utime_ = std::max(utime_, existence.utime);
  for (const model::LandmarkExistence& one : existence.landmarks) landmarks_.set_existence(one);
  SceneNumbers& numbers = changed(numbers_);
  numbers.missing_share = existence.missing_share;
  numbers.new_share = existence.new_share;
  numbers.is_mapping_needed = existence.is_mapping_needed;
}

void Scene::take(const model::Submap& submap) {
  for (const model::MapLandmark& landmark : submaps_.take(submap)) landmarks_.set(landmark);
  for (const model::SubmapId id : submap.replaced) handed_over_keyframes_.erase(id);
  handed_over_keyframes_[submap.id] = submap.keyframes;
  submaps_change_ = ++change_;
}

void Scene::take(const model::MapCorrection& correction) {
  const auto moved = submaps_.take(correction);
  if (moved.empty()) return;
  for (const model::MapLandmark& landmark : moved) landmarks_.set(landmark);
  move_keyframes(correction);
  submaps_change_ = ++change_;
}

void Scene::move_keyframes(const model::MapCorrection& correction) {
  std::vector<model::KeyframePose> moved;
  for (const model::SubmapPose& pose : correction.submaps) {
    const auto found = handed_over_keyframes_.find(pose.id);
    if (found == handed_over_keyframes_.end()) continue;
    for (model::KeyframePose keyframe : found->second) {
      keyframe.map_T_vehicle = pose.map_T_submap * keyframe.map_T_vehicle;
      moved.push_back(keyframe);
    }
  }
  keyframes_.take(moved);
}

void Scene::take(const model::LoopClosure& closure) {
  if (!closures_.contains(closure.id) && closures_.size() >= kMostClosures)
    closures_.erase(closures_.begin());
  SceneClosure& one = closures_[closure.id];
  if (closure.is_revoked) {
    one.closure.id = closure.id;
    one.status = "revoked";
  } else {
    one.closure = closure;
  }
  closures_change_ = ++change_;
}

void Scene::take(const model::LoopResult& result) {
  const auto found = closures_.find(result.closure_id);
  if (found == closures_.end()) return;
  found->second.status = result_text(result.status);
  found->second.reason = result.reason;
  closures_change_ = ++change_;
}
void Scene::take_stored(std::span<const model::MapLandmark> landmarks,
                        std::span<const model::LandmarkExistence> existence,
                        std::span<const model::KeyframePose> keyframes) {
  keyframes_.take(keyframes);
  for (const model::MapLandmark& landmark : landmarks) landmarks_.set(landmark, true);
  for (const model::LandmarkExistence& one : existence) landmarks_.set_existence(one);
}

std::optional<Eigen::Vector2d> Scene::place_of(const model::LoopEnd& end) const {
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
