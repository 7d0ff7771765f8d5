#include "services/viewer/landmark_table.hpp"

#include <bit>
#include <limits>

namespace understory::viewer {
namespace {

/// Bit for bit: an unknown probability is NaN.
bool is_same(const SceneLandmark& a, const SceneLandmark& b) {
  return a.id == b.id && a.x_m == b.x_m && a.y_m == b.y_m &&
         a.covariance_xx_m2 == b.covariance_xx_m2 && a.covariance_xy_m2 == b.covariance_xy_m2 &&
         a.covariance_yy_m2 == b.covariance_yy_m2 && a.radius_m == b.radius_m &&
         std::bit_cast<std::uint32_t>(a.probability) ==
             std::bit_cast<std::uint32_t>(b.probability) &&
         a.seen == b.seen && a.flags == b.flags;
}

}  // namespace

void LandmarkTable::set(const model::MapLandmark& landmark, bool is_given) {
  const auto found = slot_of_.find(landmark.id);
  const Slot slot = found == slot_of_.end() ? new_slot() : found->second;
  SceneLandmark one = landmarks_[slot];
  if (found == slot_of_.end()) {
    slot_of_.emplace(landmark.id, slot);
    one = {};
    one.probability = std::numeric_limits<float>::quiet_NaN();
  }

  one.id = landmark.id;
  one.x_m = static_cast<float>(landmark.position_m.x());
  one.y_m = static_cast<float>(landmark.position_m.y());
  one.covariance_xx_m2 = static_cast<float>(landmark.covariance_m2(0, 0));
  one.covariance_xy_m2 = static_cast<float>(landmark.covariance_m2(0, 1));
  one.covariance_yy_m2 = static_cast<float>(landmark.covariance_m2(1, 1));
  one.radius_m = static_cast<float>(landmark.radius_m);
  one.seen = landmark.observation_count;
  one.flags = static_cast<std::uint8_t>(
      (one.flags & SceneLandmark::kOutOfUse) | SceneLandmark::kThere |
      (landmark.kind == model::LandmarkKind::kCorner ? SceneLandmark::kCorner : 0) |
      (is_given ? SceneLandmark::kGiven : 0));
  if (is_same(one, landmarks_[slot])) return;
  landmarks_[slot] = one;
  touch(slot);
}

void LandmarkTable::set_existence(const model::LandmarkExistence& existence) {
  const auto found = slot_of_.find(existence.id);
  if (found == slot_of_.end()) return;
  SceneLandmark one = landmarks_[found->second];
  const bool was_unused = (one.flags & SceneLandmark::kOutOfUse) != 0;
  one.probability = static_cast<float>(existence.probability);
  one.flags = static_cast<std::uint8_t>(one.flags & ~SceneLandmark::kOutOfUse);
  if (!existence.is_in_use) one.flags |= SceneLandmark::kOutOfUse;

  if (was_unused && existence.is_in_use) --unused_;
  if (!was_unused && !existence.is_in_use) ++unused_;
  if (is_same(one, landmarks_[found->second])) return;
  landmarks_[found->second] = one;
  touch(found->second);
}

void LandmarkTable::remove(model::LandmarkId id) {
  const auto found = slot_of_.find(id);
  if (found == slot_of_.end()) return;
  const Slot slot = found->second;
  if ((landmarks_[slot].flags & SceneLandmark::kOutOfUse) != 0) --unused_;
  landmarks_[slot] = {};
  free_.push_back(slot);
  slot_of_.erase(found);
  touch(slot);
}

void LandmarkTable::clear() {
  landmarks_.clear();
  order_.clear();
  free_.clear();
  slot_of_.clear();
  first_ = last_ = kNone;
  unused_ = 0;
}

const SceneLandmark* LandmarkTable::find(model::LandmarkId id) const {
  const auto found = slot_of_.find(id);
  return found == slot_of_.end() ? nullptr : &landmarks_[found->second];
}

std::optional<Slot> LandmarkTable::slot_of(model::LandmarkId id) const {
  const auto found = slot_of_.find(id);
  if (found == slot_of_.end()) return std::nullopt;
  return found->second;
}

Slot LandmarkTable::new_slot() {
  if (!free_.empty()) {
    const Slot slot = free_.back();
    free_.pop_back();
    return slot;
  }
  landmarks_.emplace_back();
  order_.emplace_back();
  return static_cast<Slot>(landmarks_.size() - 1);
}

void LandmarkTable::touch(Slot slot) {
  unlink(slot);
  Order& one = order_[slot];
  one.change = ++*changes_;
  one.before = last_;
  one.after = kNone;
  if (last_ != kNone) order_[last_].after = slot;
  last_ = slot;
  if (first_ == kNone) first_ = slot;
}

void LandmarkTable::unlink(Slot slot) {
  Order& one = order_[slot];
  if (one.change == 0) return;  // Not in the list yet.
  if (one.before != kNone) order_[one.before].after = one.after;
  if (one.after != kNone) order_[one.after].before = one.before;
  if (first_ == slot) first_ = one.after;
  if (last_ == slot) last_ = one.before;
}

Slot LandmarkTable::first_after(const LandmarkCursor& cursor) const {
  if (cursor.change == 0) return first_;
  // If the last landmark read has not changed, the next one is its successor.
  if (cursor.slot < order_.size() && order_[cursor.slot].change == cursor.change)
    return order_[cursor.slot].after;
  Slot slot = kNone;
  for (Slot at = last_; at != kNone && order_[at].change > cursor.change; at = order_[at].before)
    slot = at;
  return slot;
}

std::vector<Slot> LandmarkTable::changed_since(LandmarkCursor& cursor, std::size_t most) const {
  std::vector<Slot> slots;
  for (Slot slot = first_after(cursor); slot != kNone && slots.size() < most;
       slot = order_[slot].after) {
    slots.push_back(slot);
    cursor = {order_[slot].change, slot};
  }
  return slots;
}

}  // namespace understory::viewer
