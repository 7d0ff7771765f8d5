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
  map_ = map;
  has_whole_ = true;
  missed_ = 0;
}

void HeldMap::take(const MapDelta& delta) {
  // A map's first change; its first update may have come before it.
  const bool is_first = delta.base_version == 0;
  if (is_first && (!map_ || map_->version != 0)) start();
  if (!map_ || delta.version <= map_->version) return;
  if (delta.base_version != map_->version) ++missed_;

  map_->utime = std::max(map_->utime, delta.utime);
  map_->version = delta.version;
  map_->landmarks = with_delta(std::move(map_->landmarks), delta);
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

void HeldMap::start() {
  map_.emplace();
  has_whole_ = false;
  missed_ = 0;
}

}  // namespace understory::model
