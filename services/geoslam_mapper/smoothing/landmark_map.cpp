#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// The index is for search and gating only: following every millimetre would cost more than it
/// gains. Most moves are small rotations of whole stretches of the map. After an update of the
/// index the triangles wait for the next search: each needs a triangulation, and a closing loop
/// moves all landmarks repeatedly.
constexpr double kIndexTolerance_m = 0.01;

}  // namespace

void LandmarkMap::add_given(const model::MapLandmark& given, double sigma_m) {
  const bool has_covariance = given.covariance_m2.determinant() > 0.0;

  StoredLandmark landmark;
  landmark.position_m = given.position_m;
  landmark.prior_covariance =
      has_covariance ? given.covariance_m2
                     : Eigen::Matrix2d(sigma_m * sigma_m * Eigen::Matrix2d::Identity());
  landmark.information = 2.0 / landmark.prior_covariance.trace();
  landmark.radius_m = given.radius_m;
  landmark.observation_count = given.observation_count;
  landmark.kind = given.kind;

  if (given.id == 0) {
    insert(landmark);
    return;
  }
  landmark.id = given.id;
  put(landmark);
  next_id_ = std::max(next_id_, given.id + 1);
}

model::LandmarkId LandmarkMap::insert(StoredLandmark landmark) {
  landmark.id = next_id_++;
  put(landmark);
  return landmark.id;
}

void LandmarkMap::put(const StoredLandmark& landmark) {
  landmarks_[landmark.id] = landmark;
  has_given_ = has_given_ || landmark.is_given();
  index_of(landmark).insert(landmark.id, landmark.position_m);
  changed_.push_back(landmark.id);
}

void LandmarkMap::remove(model::LandmarkId id) {
  landmarks_.erase(id);
  index_.remove(id);
  unused_index_.remove(id);
}

void LandmarkMap::set_in_use(model::LandmarkId id, bool is_in_use) {
  const auto found = landmarks_.find(id);
  if (found == landmarks_.end() || found->second.is_unused != is_in_use) return;
  StoredLandmark& landmark = found->second;
  index_of(landmark).remove(id);
  landmark.is_unused = !is_in_use;
  landmark.is_late = false;
  index_of(landmark).insert(id, landmark.position_m);
}

StoredLandmark LandmarkMap::put_away(model::LandmarkId id) {
  StoredLandmark landmark = std::move(landmarks_.at(id));
  remove(id);
  return landmark;
}

void LandmarkMap::bring_back(StoredLandmark landmark) {
  landmark.is_late = false;
  put(landmark);
}

std::vector<StoredLandmark> LandmarkMap::release() {
  std::vector<StoredLandmark> released;
  released.reserve(landmarks_.size());
  for (auto& [id, landmark] : landmarks_) released.push_back(std::move(landmark));
  landmarks_.clear();
  index_ = {};
  unused_index_ = {};
  late_.clear();
  return released;
}

void LandmarkMap::move(model::LandmarkId id, const Eigen::Vector2d& position_m) {
  StoredLandmark& landmark = landmarks_.at(id);
  landmark.position_m = position_m;
  changed_.push_back(id);

  constellation::ConstellationMap& index = index_of(landmark);
  const std::optional<Eigen::Vector2d> indexed = index.position(id);
  if (!indexed) return;
  const double distance = (*indexed - position_m).norm();
  if (distance > kStaleness_m) {
    index.shift(id, position_m);
  } else if (distance > kIndexTolerance_m && !landmark.is_late) {
    landmark.is_late = true;
    if (late_.size() >= 2 * landmarks_.size()) forget_gone_late();
    late_.push_back(id);
  }
}

/// Keeps the first entry of each landmark that is late. If landmarks are handed over all along a
/// drive and the index is never brought up to date, entries of removed landmarks would accumulate.
void LandmarkMap::forget_gone_late() {
  std::erase_if(late_, [&](model::LandmarkId id) {
    const auto found = landmarks_.find(id);
    return found == landmarks_.end() || !std::exchange(found->second.is_late, false);
  });
  for (const model::LandmarkId id : late_) landmarks_.at(id).is_late = true;
}

void LandmarkMap::catch_up() {
  for (const model::LandmarkId id : late_) {
    const auto found = landmarks_.find(id);
    if (found == landmarks_.end()) continue;

    found->second.is_late = false;
    constellation::ConstellationMap& index = index_of(found->second);
    const std::optional<Eigen::Vector2d> indexed = index.position(id);
    if (indexed && (*indexed - found->second.position_m).norm() > kIndexTolerance_m)
      index.shift(id, found->second.position_m);
  }
  late_.clear();
  index_.settle();
  unused_index_.settle();
}

std::vector<model::LandmarkId> LandmarkMap::take_changed() {
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  std::erase_if(changed_, [&](model::LandmarkId id) { return !landmarks_.contains(id); });
  return std::exchange(changed_, {});
}

void LandmarkMap::mark_all_changed() {
  for (const auto& [id, landmark] : landmarks_) changed_.push_back(id);
}

std::vector<Eigen::Vector2d> LandmarkMap::indexed_positions() const {
  std::vector<Eigen::Vector2d> result;
  result.reserve(landmarks_.size());
  for (const auto& [id, landmark] : landmarks_) {
    const constellation::ConstellationMap& index = landmark.is_unused ? unused_index_ : index_;
    result.push_back(index.position(id).value_or(landmark.position_m));
  }
  return result;
}

void LandmarkMap::rebuild_index(const std::vector<Eigen::Vector2d>& indexed_m) {
  if (indexed_m.size() != landmarks_.size())
    throw std::invalid_argument("mapper state: its index does not fit its landmarks");
  index_ = {};
  unused_index_ = {};
  auto position = indexed_m.begin();
  for (const auto& [id, landmark] : landmarks_) {
    index_of(landmark).insert(id, *position++);
    has_given_ = has_given_ || landmark.is_given();
  }
}

}  // namespace understory::geoslam_mapper::smoothing
