#include "services/submap_store/submap_store.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/state/archive.hpp"

namespace understory::submap_store {
namespace {

constexpr state::Format kFormat{"submap_store", 3};
/// Most closures that wait for the mapper's result.
constexpr std::size_t kMostProposed = 1000;
constexpr std::size_t kWhole = std::numeric_limits<std::size_t>::max();

/// Number of the landmarks' map; 0 without landmarks. Earlier maps, with lower numbers, may have
/// become part of it.
std::uint32_t map_of(const std::vector<model::MapLandmark>& landmarks) {
  std::uint32_t result = 0;
  for (const model::MapLandmark& one : landmarks) result = std::max(result, model::map_of(one.id));
  return result;
}

}  // namespace

bool SubmapStore::begins_drive(const model::MapUpdate& update, std::uint32_t highest_map) {
  return update.status == model::MapUpdateStatus::kFirstMap && update.map_id <= highest_map;
}

void SubmapStore::take(const model::WholeMap& map) {
  if (!map.complete) return;
  go_to(map_of(map.landmarks));
  if (ground_.map_id() != 0) ground_.take(map);
}

void SubmapStore::take(const model::MapDelta& delta) {
  // Only the first change of a map may arrive before any other message of it.
  if (delta.base_version == 0) go_to(map_of(delta.added));
  if (ground_.map_id() == 0) return;
  ground_.take(delta);
  forget(delta);
}

void SubmapStore::take(const model::MapUpdate& update) {
  using enum model::MapUpdateStatus;
  const bool starts = update.status == kFirstMap;
  if (!starts && update.status != kUpdated) return;
  if (!starts && ground_.map_id() != update.map_id) {
    go_to(update.map_id);
    ground_.want_whole();
  }
  go_to(update.map_id);
  ground_.take(update);
  is_provisional_ = update.is_provisional;
}

void SubmapStore::take(const model::MapCorrection& correction) {
  const bool is_newer = !correction_ || correction_->map_id != correction.map_id ||
                        correction_->version < correction.version;
  if (is_newer) correction_ = correction;
}

void SubmapStore::take(const model::LoopClosure& closure) {
  if (closure.is_revoked) return;
  if (proposed_.size() >= kMostProposed) proposed_.erase(proposed_.begin());
  proposed_[closure.id] = closure;
}

void SubmapStore::take(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  if (result.status == kWaiting) return;
  if (result.status == kRevoked) {
    model::LoopClosure revoked;
    revoked.map_id = result.map_id;
    revoked.id = result.closure_id;
    revoked.is_revoked = true;
    left_.closures.push_back(revoked);
  }
  const auto found = proposed_.find(result.closure_id);
  if (found == proposed_.end()) return;
  if (result.status == kAccepted && found->second.map_id == result.map_id)
    left_.closures.push_back(found->second);
  proposed_.erase(found);
}

void SubmapStore::take(const model::ExistenceState& state) { existence_[state.map_id].take(state); }

geometry::SE2 SubmapStore::pose_of(const model::Submap& submap) const {
  if (!correction_ || correction_->map_id != submap.map_id || correction_->utime < submap.utime)
    return submap.map_T_submap;
  const auto found =
      std::ranges::lower_bound(correction_->submaps, submap.id, {}, &model::SubmapPose::id);
  const bool is_there = found != correction_->submaps.end() && found->id == submap.id;
  return is_there ? found->map_T_submap : submap.map_T_submap;
}

void SubmapStore::stored(const model::Submap& submap) {
  if (submap.map_id == ground_.map_id()) ground_.hand_over(submap);
}

void SubmapStore::begin_drive() {
  const std::uint32_t map_id = ground_.map_id();
  *this = SubmapStore();
  if (map_id == 0) return;
  ground_ = Ground(map_id);
  ground_.want_whole();
}

Writes SubmapStore::due() const {
  Writes result = left_;
  if (auto change = ground_.change()) result.ground.push_back(*std::move(change));
  for (const auto& [map_id, newest] : existence_) {
    if (map_id <= ground_.map_id()) result.existence.emplace_back(map_id, newest.stored());
  }
  return result;
}

void SubmapStore::written() {
  left_ = {};
  ground_.written();
  existence_.erase(existence_.begin(), existence_.upper_bound(ground_.map_id()));
}

std::string SubmapStore::save() const {
  return state::save(kFormat, ground_, is_provisional_, left_, correction_, proposed_, existence_);
}

void SubmapStore::load(const std::string& state) {
  SubmapStore loaded;
  state::load(state, kFormat, loaded.ground_, loaded.is_provisional_, loaded.left_,
              loaded.correction_, loaded.proposed_, loaded.existence_);
  *this = std::move(loaded);
  ground_.want_whole();
}

/// Writes the map before for the last time; a map with few agreeing keyframes is deleted.
void SubmapStore::go_to(std::uint32_t map_id) {
  if (map_id == 0 || map_id == ground_.map_id()) return;
  ground_.draw(kWhole);
  if (is_provisional_) {
    left_.dropped_maps.push_back(ground_.map_id());
    existence_.erase(ground_.map_id());
  } else if (auto change = ground_.change()) {
    left_.ground.push_back(*std::move(change));
  }
  ground_ = Ground(map_id);
  is_provisional_ = false;
  proposed_.clear();
}

/// Removed landmarks, and merged ones: the tracker has fused the two.
void SubmapStore::forget(const model::MapDelta& delta) {
  const auto found = existence_.find(ground_.map_id());
  if (found == existence_.end()) return;
  for (const model::LandmarkId id : delta.removed) found->second.drop(id);
  for (const auto& [old_id, new_id] : delta.merged) found->second.drop(old_id);
}

}  // namespace understory::submap_store
