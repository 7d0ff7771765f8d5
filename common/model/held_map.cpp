#include "common/model/held_map.hpp"

#include <algorithm>

namespace understory::model {

std::vector<MapLandmark> with_delta(std::vector<MapLandmark> landmarks, const MapDelta& delta) {
  const auto place_of = [&](LandmarkId id) {
    return std::ranges::lower_bound(landmarks, id, {}, &MapLandmark::id);
  };
  const auto put = [&](const MapLandmark& landmark) {
    const auto place = place_of(landmark.id);
    if (place != landmarks.end() && place->id == landmark.id) {
      *place = landmark;
    } else {
      landmarks.insert(place, landmark);
    }
  };
  const auto drop = [&](LandmarkId id) {
    const auto place = place_of(id);
    if (place != landmarks.end() && place->id == id) landmarks.erase(place);
  };

  for (const MapLandmark& landmark : delta.added) put(landmark);
  for (const MapLandmark& landmark : delta.moved) put(landmark);
  for (const LandmarkId id : delta.removed) drop(id);
  for (const auto& [old_id, new_id] : delta.merged) drop(old_id);
  return landmarks;
}

void HeldMap::take(const WholeMap& map) {
  if (!map.complete) return;
  for (const MapLandmark& landmark : map.landmarks) comes_back(landmark.id);
  map_ = map;
  has_whole_ = true;
  missed_ = 0;
}

void HeldMap::take(const MapDelta& delta) {
  // A map's first change; its first update may have arrived before it.
  const bool is_first = delta.base_version == 0;
  if (is_first && (!map_ || map_->version != 0)) start();
  if (!map_ || delta.version <= map_->version) return;
  if (delta.base_version != map_->version) ++missed_;

  map_->utime = std::max(map_->utime, delta.utime);
  map_->version = delta.version;
  map_->landmarks = with_delta(std::move(map_->landmarks), delta);
  if (away_of_.empty()) return;
  for (const MapLandmark& landmark : delta.added) comes_back(landmark.id);
  for (const MapLandmark& landmark : delta.moved) comes_back(landmark.id);
  for (const LandmarkId id : delta.removed) comes_back(id);
  for (const auto& [old_id, new_id] : delta.merged) comes_back(old_id);
}

void HeldMap::take(const MapUpdate& update) {
  const bool starts = update.status == MapUpdateStatus::kFirstMap;
  if (starts) start();
  if (!map_ || (!starts && update.status != MapUpdateStatus::kUpdated)) return;
  if (!map_->keyframes.empty() && update.utime <= map_->keyframes.back().utime) return;

  map_->utime = std::max(map_->utime, update.utime);
  map_->keyframes.push_back(
      {update.keyframe_sequence, update.utime, update.map_T_vehicle, update.covariance});
}

void HeldMap::take(const Submap& submap) {
  for (const SubmapId id : submap.replaced) {
    const auto gone = away_.find(id);
    if (gone == away_.end()) continue;
    for (const MapLandmark& landmark : gone->second.landmarks) away_of_.erase(landmark.id);
    away_.erase(gone);
  }
  for (const MapLandmark& landmark : submap.landmarks) {
    comes_back(landmark.id);
    away_of_[landmark.id] = submap.id;
  }
  away_[submap.id] = {submap.map_T_submap, submap.landmarks, submap.keyframes};
  if (!map_) return;

  std::erase_if(map_->landmarks, [&](const MapLandmark& one) {
    const auto found = away_of_.find(one.id);
    return found != away_of_.end() && found->second == submap.id;
  });
  std::erase_if(map_->keyframes, [&](const KeyframePose& one) {
    return std::ranges::find(submap.keyframes, one.keyframe_sequence,
                             &KeyframePose::keyframe_sequence) != submap.keyframes.end();
  });
}

void HeldMap::take(const MapCorrection& correction) {
  for (const SubmapPose& pose : correction.submaps) {
    const auto found = away_.find(pose.id);
    if (found != away_.end()) found->second.map_T_submap = pose.map_T_submap;
  }
}

/// Removes the landmark from its submap.
void HeldMap::comes_back(LandmarkId id) {
  const auto found = away_of_.find(id);
  if (found == away_of_.end()) return;
  std::erase_if(away_.at(found->second).landmarks,
                [&](const MapLandmark& one) { return one.id == id; });
  away_of_.erase(found);
}

std::optional<WholeMap> HeldMap::whole() const {
  if (!map_ || away_.empty()) return map_;
  WholeMap whole = *map_;
  for (const auto& [id, away] : away_) {
    const Eigen::Matrix2d rotation = away.map_T_submap.rotation();
    for (MapLandmark landmark : away.landmarks) {
      landmark.position_m = away.map_T_submap * landmark.position_m;
      landmark.covariance_m2 = rotation * landmark.covariance_m2 * rotation.transpose();
      whole.landmarks.push_back(landmark);
    }
    for (KeyframePose keyframe : away.keyframes) {
      keyframe.map_T_vehicle = away.map_T_submap * keyframe.map_T_vehicle;
      whole.keyframes.push_back(keyframe);
    }
  }

  // Keyframes taken back may be in both.
  std::ranges::sort(whole.landmarks, {}, &MapLandmark::id);
  std::ranges::stable_sort(whole.keyframes, {}, &KeyframePose::utime);
  const auto twice = std::unique(
      whole.keyframes.begin(), whole.keyframes.end(),
      [](const auto& a, const auto& b) { return a.keyframe_sequence == b.keyframe_sequence; });
  whole.keyframes.erase(twice, whole.keyframes.end());
  return whole;
}

void HeldMap::start() {
  map_.emplace();
  away_.clear();
  away_of_.clear();
  has_whole_ = false;
  missed_ = 0;
}

}  // namespace understory::model
