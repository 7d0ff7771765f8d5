#include "services/geoslam_mapper/smoothing/landmark_store.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// The index is for finding and gating: following every millimetre would cost more than it gives.
/// Most moves are of whole stretches of the map that turn by a hair; each costs a triangulation.
constexpr double kIndexTolerance_m = 0.01;

}  // namespace

model::LandmarkId LandmarkStore::insert(StoredLandmark landmark) {
  landmark.id = next_id_++;
  restore(landmark);
  return landmark.id;
}

void LandmarkStore::restore(const StoredLandmark& landmark) {
  landmarks_[landmark.id] = landmark;
  index_.insert(landmark.id, landmark.position_m);
}

void LandmarkStore::remove(model::LandmarkId id) {
  landmarks_.erase(id);
  index_.remove(id);
}

void LandmarkStore::move(model::LandmarkId id, const Eigen::Vector2d& position_m) {
  StoredLandmark& landmark = landmarks_.at(id);
  landmark.position_m = position_m;
  const std::optional<Eigen::Vector2d> indexed = index_.position(id);
  if (!indexed) return;
  const double distance = (*indexed - position_m).norm();
  if (distance > kStaleness_m) {
    index_.move(id, position_m);
  } else if (distance > kIndexTolerance_m && !landmark.is_late) {
    landmark.is_late = true;
    late_.push_back(id);
  }
}

void LandmarkStore::catch_up() {
  for (const model::LandmarkId id : late_) {
    const auto found = landmarks_.find(id);
    if (found == landmarks_.end()) continue;
    found->second.is_late = false;
    const std::optional<Eigen::Vector2d> indexed = index_.position(id);
    if (indexed && (*indexed - found->second.position_m).norm() > kIndexTolerance_m)
      index_.move(id, found->second.position_m);
  }
  late_.clear();
}

}  // namespace understory::geoslam_mapper::smoothing
