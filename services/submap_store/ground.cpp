#include "services/submap_store/ground.hpp"

#include <algorithm>

namespace understory::submap_store {

void Ground::take(const model::WholeMap& map) {
  utime_ = std::max(utime_, map.utime);
  version_ = map.version;
  landmarks_.clear();
  moved_.clear();
  gone_.clear();
  for (const model::MapLandmark& one : map.landmarks) landmarks_[one.id] = one;
  for (const model::KeyframePose& one : map.keyframes) keyframes_[one.utime] = one;
  is_whole_ = true;
  wants_whole_ = false;
}

void Ground::take(const model::MapDelta& delta) {
  const bool is_first = delta.base_version == 0;
  if (!is_first && delta.version <= version_) return;
  if (!is_first && delta.base_version != version_) wants_whole_ = true;
  utime_ = std::max(utime_, delta.utime);
  version_ = delta.version;

  for (const model::MapLandmark& one : delta.added) put(one);
  for (const model::MapLandmark& one : delta.moved) move(one);
  for (const model::LandmarkId id : delta.removed) remove(id);
  for (const auto& [old_id, new_id] : delta.merged) remove(old_id);
}

void Ground::take(const model::MapUpdate& update) {
  utime_ = std::max(utime_, update.utime);
  keyframes_[update.utime] = {update.keyframe_sequence, update.utime, update.map_T_vehicle,
                              update.covariance};
}

void Ground::hand_over(const model::Submap& submap) {
  for (const model::MapLandmark& one : submap.landmarks) {
    landmarks_.erase(one.id);
    moved_.erase(one.id);
    gone_.erase(one.id);
  }
  for (const model::KeyframePose& one : submap.keyframes) keyframes_.erase(one.utime);
}

void Ground::draw(std::size_t most) {
  for (std::size_t count = std::min(most, moved_.size()); count > 0; --count) {
    auto one = moved_.lower_bound(next_moved_);
    if (one == moved_.end()) one = moved_.begin();
    next_moved_ = one->first + 1;
    landmarks_.insert(moved_.extract(one));
  }
}

std::optional<map_file::GroundChange> Ground::change() const {
  if (landmarks_.empty() && gone_.empty() && keyframes_.empty() && !is_whole_) return std::nullopt;
  map_file::GroundChange change{map_id_, utime_, {}, {}, {}, is_whole_};
  for (const auto& [id, one] : landmarks_) change.landmarks.push_back(one);
  for (const auto& [id, is_gone] : gone_) change.gone.push_back(id);
  for (const auto& [utime, one] : keyframes_) change.keyframes.push_back(one);
  return change;
}

void Ground::written() {
  landmarks_.clear();
  gone_.clear();
  keyframes_.clear();
  is_whole_ = false;
}

void Ground::put(const model::MapLandmark& landmark) {
  landmarks_[landmark.id] = landmark;
  moved_.erase(landmark.id);
  gone_.erase(landmark.id);
}

/// A landmark that is not in the file does not wait.
void Ground::move(const model::MapLandmark& landmark) {
  if (landmarks_.contains(landmark.id) || gone_.contains(landmark.id)) return put(landmark);
  moved_[landmark.id] = landmark;
}

void Ground::remove(model::LandmarkId id) {
  landmarks_.erase(id);
  moved_.erase(id);
  gone_[id] = true;
}

}  // namespace understory::submap_store
