#include "common/story/landmark_book.hpp"

#include <algorithm>

namespace understory::story {
namespace {

constexpr std::size_t kBytesOfSubmap = 160;

bool is_placed(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

Sight sight_of(const model::MapUpdate& update) {
  return {update.utime, update.keyframe_sequence, update.map_T_vehicle.translation()};
}

}  // namespace

LandmarkBook::LandmarkBook(const Limits& limits, std::size_t bytes)
    : limits_(limits), moments_(limits.moments), records_(limits.landmarks, bytes) {}

std::size_t LandmarkBook::fixed_bytes(const Limits& limits) {
  return History<Moment>::bytes_of(limits.moments) + limits.submaps * kBytesOfSubmap;
}

void LandmarkBook::take(const model::MapUpdate& update) {
  if (!is_placed(update)) return;
  map_in_use_ = update.map_id;
  const MomentNumber moment = moments_.add(update);
  const Sight sight = sight_of(update);
  const bool starts = update.status == model::MapUpdateStatus::kFirstMap;
  for (const model::LandmarkId id : update.added) born(id, starts, update.utime, moment);
  for (const model::Association& one : update.associations) seen(one.landmark_id, sight, moment);
  for (const model::ExpectedLandmark& one : update.expected) missed(one.id, moment);
  for (const auto& [old_id, new_id] : update.merged) merged(old_id, new_id, moment);
  for (const model::LandmarkId id : update.removed) removed(id, moment);
}

void LandmarkBook::take(const model::MapDelta& delta) {
  const MomentNumber moment = moments_.at(delta.utime);
  for (const model::MapLandmark& one : delta.added) told(one, Origin::kByMapChange, moment);
  for (const model::MapLandmark& one : delta.moved) ++told(one, Origin::kByMapChange, moment).moves;
  for (const auto& [old_id, new_id] : delta.merged) merged(old_id, new_id, moment);
  for (const model::LandmarkId id : delta.removed) removed(id, moment);
}

void LandmarkBook::take(const model::WholeMap& map) {
  if (map.landmarks.empty()) return;
  const MomentNumber moment = moments_.at(map.utime);
  if (map.complete) {
    ++wholes_;
    latest_whole_[model::map_of(map.landmarks.back().id)] = wholes_;
  }
  for (const model::MapLandmark& one : map.landmarks) {
    LandmarkRecord& record = told(one, Origin::kByMap, moment);
    if (map.complete) record.in_whole = wholes_;
  }
}

void LandmarkBook::take(const model::Existence& existence) {
  const MomentNumber moment = moments_.at(existence.utime);
  for (const model::LandmarkExistence& one : existence.landmarks) {
    LandmarkRecord& record = records_.touch(one.id);
    const auto probability = static_cast<float>(one.probability);
    record.probabilities.push({moment, probability}, limits_.probabilities, records_.budget());
    record.least_probability = std::min(record.least_probability, probability);
    if (record.is_in_use == one.is_in_use) continue;
    record.is_in_use = one.is_in_use;
    note(record, {moment, one.is_in_use ? EventKind::kUsed : EventKind::kUnused});
  }
}

void LandmarkBook::take(const model::Submap& submap) {
  const MomentNumber moment = moments_.at(submap.utime);
  const std::pair key(submap.map_id, submap.id);
  if (submaps_.size() >= limits_.submaps && !submaps_.contains(key))
    submaps_.erase(submaps_.begin());
  submaps_[key] = {submap.map_T_submap, submap.map_T_submap};

  for (model::MapLandmark one : submap.landmarks) {
    one.position_m = submap.map_T_submap * one.position_m;
    const Eigen::Matrix2d rotation = submap.map_T_submap.rotation();
    one.covariance_m2 = rotation * one.covariance_m2 * rotation.transpose();
    LandmarkRecord& record = told(one, Origin::kByMap, moment);
    record.submap = submap.id;
    record.submap_map = submap.map_id;
    note(record, {moment, EventKind::kHandedOver, submap.id});
  }
}

void LandmarkBook::take(const model::MapCorrection& correction) {
  for (const model::SubmapPose& one : correction.submaps) {
    const auto found = submaps_.find({correction.map_id, one.id});
    if (found != submaps_.end()) found->second.now_map_T_submap = one.map_T_submap;
  }
}

Eigen::Vector2d LandmarkBook::position_m(const LandmarkRecord& record) const {
  const auto found = submaps_.find({record.submap_map, record.submap});
  if (record.submap == 0 || found == submaps_.end()) return record.now_m;
  return found->second.now_map_T_submap *
         (found->second.then_map_T_submap.inverse() * record.now_m);
}

bool LandmarkBook::is_left_out(const LandmarkRecord& record) const {
  if (record.fate != Fate::kThere || record.submap != 0 || record.in_whole == 0) return false;
  const auto found = latest_whole_.find(model::map_of(record.id));
  return found != latest_whole_.end() && record.in_whole < found->second;
}

void LandmarkBook::note(LandmarkRecord& record, LandmarkEvent event) {
  record.events.push(event, limits_.events, records_.budget());
}

void LandmarkBook::born(model::LandmarkId id, bool with_its_map, model::Utime utime,
                        MomentNumber moment) {
  LandmarkRecord& record = records_.touch(id);
  // MAP_DELTA reports it too, and may have arrived before.
  const bool is_news = record.origin == Origin::kNotTold ||
                       (record.origin == Origin::kByMapChange && record.told_utime == utime);
  const bool is_anew = !is_news && with_its_map;
  if (!is_news && !is_anew) {
    record.fate = Fate::kThere;
    return note(record, {moment, EventKind::kJoined});
  }

  if (is_anew) records_.begin_again(record);
  record.origin = Origin::kByKeyframe;
  record.birth = moment;
  note(record, {moment, is_anew ? EventKind::kBornAgain : EventKind::kBorn});
}

void LandmarkBook::seen(model::LandmarkId id, const Sight& sight, MomentNumber moment) {
  LandmarkRecord& record = records_.touch(id);
  // Two landmarks of a keyframe may be the same landmark of the map.
  if (record.seen > 0 && record.last_seen == moment) return;
  const std::uint32_t placed = moments_.find(moment)->placed;
  if (record.seen == 0) {
    record.first_seen = sight;
  } else if (placed > record.last_seen_placed + 1) {
    ++record.gaps;
    record.longest_gap = std::max(record.longest_gap, placed - record.last_seen_placed - 1);
  }

  ++record.seen;
  record.last_seen = moment;
  record.last_seen_placed = placed;
  record.looks.push({moment, 1}, limits_.looks, records_.budget());
}

void LandmarkBook::missed(model::LandmarkId id, MomentNumber moment) {
  LandmarkRecord& record = records_.touch(id);
  ++record.missed;
  record.last_missed = moment;
  record.looks.push({moment, 0}, limits_.looks, records_.budget());
}

/// SLAM_UPDATE and MAP_DELTA both report a merge.
void LandmarkBook::merged(model::LandmarkId old_id, model::LandmarkId new_id, MomentNumber moment) {
  LandmarkRecord& old = records_.touch(old_id);
  if (old.fate == Fate::kMerged && old.survivor == new_id) return;
  old.fate = Fate::kMerged;
  old.survivor = new_id;
  old.end = moment;
  note(old, {moment, EventKind::kMerged, new_id});
  note(records_.touch(new_id), {moment, EventKind::kTookUp, old_id});
}

void LandmarkBook::removed(model::LandmarkId id, MomentNumber moment) {
  LandmarkRecord& record = records_.touch(id);
  if (record.fate != Fate::kThere) return;
  record.fate = Fate::kRemoved;
  record.end = moment;
  note(record, {moment, EventKind::kRemoved});
}

LandmarkRecord& LandmarkBook::told(const model::MapLandmark& landmark, Origin origin,
                                   MomentNumber moment) {
  LandmarkRecord& record = records_.touch(landmark.id);
  if (record.origin == Origin::kNotTold) {
    record.origin = origin;
    note(record, {moment, EventKind::kTold});
  }
  if (record.fate != Fate::kThere) {
    record.fate = Fate::kThere;
    record.survivor = 0;
    note(record, {moment, EventKind::kReturned});
  }
  if (record.submap != 0) {
    record.submap = 0;
    note(record, {moment, EventKind::kCameBack});
  }
  place(record, landmark, moment);
  return record;
}

void LandmarkBook::place(LandmarkRecord& record, const model::MapLandmark& landmark,
                         MomentNumber moment) {
  if (!record.has_position) {
    const Moment* const now = moments_.find(moment);
    record.told_utime = now->utime;
    record.first_m = landmark.position_m;
    record.has_position = true;
  } else {
    const auto move_m = static_cast<float>((landmark.position_m - record.now_m).norm());
    if (move_m > record.largest_move_m) {
      record.largest_move_m = move_m;
      record.largest_move = moment;
    }
  }

  record.now_m = landmark.position_m;
  record.cxx_m2 = static_cast<float>(landmark.covariance_m2(0, 0));
  record.cxy_m2 = static_cast<float>(landmark.covariance_m2(0, 1));
  record.cyy_m2 = static_cast<float>(landmark.covariance_m2(1, 1));
  record.radius_m = static_cast<float>(landmark.radius_m);
  record.observation_count = landmark.observation_count;
  record.is_corner = landmark.kind == model::LandmarkKind::kCorner;
}

}  // namespace understory::story
