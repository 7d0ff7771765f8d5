#include "services/geoslam_mapper/landmark_store.hpp"

namespace understory {
namespace {

/// The index is for finding and gating: following every millimetre would cost more than it gives.
constexpr double kIndexTolerance_m = 0.01;

}  // namespace

LandmarkId LandmarkStore::insert(StoredLandmark landmark) {
  landmark.id = next_id_++;
  restore(landmark);
  return landmark.id;
}

void LandmarkStore::restore(const StoredLandmark& landmark) {
  landmarks_[landmark.id] = landmark;
  index_.insert(landmark.id, landmark.position_m);
}

void LandmarkStore::remove(LandmarkId id) {
  landmarks_.erase(id);
  index_.remove(id);
}

void LandmarkStore::move(LandmarkId id, const Eigen::Vector2d& position_m) {
  StoredLandmark& landmark = landmarks_.at(id);
  landmark.position_m = position_m;
  const std::optional<Eigen::Vector2d> indexed = index_.position(id);
  if (indexed && (*indexed - position_m).norm() > kIndexTolerance_m) index_.move(id, position_m);
}

}  // namespace understory
