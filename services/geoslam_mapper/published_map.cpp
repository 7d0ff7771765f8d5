#include "services/geoslam_mapper/published_map.hpp"

#include <algorithm>
#include <utility>

#include "common/model/held_map.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/map_difference.hpp"

namespace understory::geoslam_mapper {

std::size_t map_bytes(std::size_t landmarks, std::size_t keyframes) {
  return wire::bytes_with<map_t, map_landmark_t>(landmarks) +
         keyframes * wire::element_bytes<keyframe_pose_t>();
}

void PublishedMap::begin_with(std::vector<model::MapLandmark> landmarks) {
  map_id_ = model::map_of(landmarks.back().id);
  landmarks_ = std::move(landmarks);
  ++version_;
  is_sent_ = false;
  must_send_ = true;
}

std::optional<model::MapDelta> PublishedMap::on_update(
    const model::MapUpdate& update, const std::vector<model::MapLandmark>& changed,
    const SetCovariances& set_covariances) {
  const bool begins_another = is_another(update);
  map_id_ = update.map_id;
  if (begins_another) landmarks_.clear();
  model::MapDelta delta = map_change(landmarks_, changed, update,
                                     {limits_.moved_m, update.map_T_vehicle.translation()});

  utime_ = std::max(utime_, update.utime);
  if (begins_another) keyframes_ = 0;
  if (update.status == model::MapUpdateStatus::kFirstMap ||
      update.status == model::MapUpdateStatus::kUpdated) {
    ++keyframes_;
    is_sent_ = false;  // Landmarks moved, even if by less than the tolerance.
  }
  const bool changes = !delta.added.empty() || !delta.moved.empty() || !delta.removed.empty() ||
                       !delta.merged.empty();
  if (!changes) return std::nullopt;
  set_covariances(delta.added);
  set_covariances(delta.moved);

  // The delta of another map has no base; versions are never reused.
  delta.base_version = begins_another ? 0 : version_;
  delta.version = ++version_;
  must_send_ |=
      delta.base_version == 0 || displaces_most(landmarks_, delta, limits_.reset_distance_m);
  landmarks_ = model::with_delta(std::move(landmarks_), delta);
  is_sent_ = false;
  return delta;
}

void PublishedMap::give_away(const model::Submap& submap) {
  if (submap.map_id != map_id_) return;
  std::erase_if(landmarks_, [&](const model::MapLandmark& known) {
    return std::ranges::binary_search(submap.landmarks, known.id, {}, &model::MapLandmark::id);
  });
  keyframes_ -= std::min<std::uint64_t>(keyframes_, submap.keyframes.size());
}

bool PublishedMap::is_due() const {
  if (is_sent_) return false;
  return (must_send_ && budget_.may_borrow()) ||
         budget_.affords(map_bytes(landmarks_.size(), keyframes_));
}

void PublishedMap::sent(std::size_t bytes) {
  budget_.spend(bytes);
  is_sent_ = true;
  must_send_ = false;
}

model::WholeMap PublishedMap::whole(std::vector<model::MapLandmark> landmarks,
                                    std::vector<model::KeyframePose> keyframes) const {
  model::WholeMap map;
  map.utime = utime_;
  map.version = version_;
  map.landmarks = std::move(landmarks);
  map.keyframes = std::move(keyframes);
  return map;
}

}  // namespace understory::geoslam_mapper
