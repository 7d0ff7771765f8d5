#include "services/existence_tracker/landmark_places.hpp"

namespace understory::existence_tracker {

void LandmarkPlaces::take(const model::WholeMap& map) {
  for (const model::MapLandmark& one : map.landmarks) places_m_[one.id] = one.position_m;
}

void LandmarkPlaces::take(const model::MapDelta& delta) {
  for (const model::MapLandmark& one : delta.added) places_m_[one.id] = one.position_m;
  for (const model::MapLandmark& one : delta.moved) places_m_[one.id] = one.position_m;
  for (const model::LandmarkId id : delta.removed) places_m_.erase(id);
  for (const auto& [old_id, new_id] : delta.merged) places_m_.erase(old_id);
}

std::optional<Eigen::Vector2d> LandmarkPlaces::at(model::LandmarkId id) const {
  const auto found = places_m_.find(id);
  if (found == places_m_.end()) return std::nullopt;
  return found->second;
}

}  // namespace understory::existence_tracker
