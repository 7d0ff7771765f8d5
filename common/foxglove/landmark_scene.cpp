#include "common/foxglove/landmark_scene.hpp"

#include <fmt/format.h>

#include <cmath>

namespace understory::foxglove {
namespace {

constexpr unsigned kBlockBits = 4;  // 16 landmarks.
/// A deletion removes entities older than its stamp [us].
constexpr model::Utime kAfter_us = 1;

/// For positions, whose size the wire limits.
double millimetres(double value) { return std::round(value * 1e3) / 1e3; }

void append_deletion(JsonText& out, model::Utime utime, bool is_all, std::string_view id) {
  out.begin_object();
  time_field(out, "timestamp", utime + kAfter_us);
  out.field("type", is_all ? 1 : 0);
  out.field("id", id);
  out.end_object();
}

/// Landmarks of a block for drawing.
template <class Block>
std::vector<DrawnLandmark> drawn(const Block& block) {
  std::vector<DrawnLandmark> result;
  result.reserve(block.size());
  for (const auto& [id, shown] : block) {
    result.push_back({shown.position_m, shown.radius_m, shown.kind,
                      existence_color(shown.probability, shown.is_in_use)});
  }
  return result;
}

}  // namespace

void LandmarkScene::take(const model::WholeMap& map) {
  if (!map.complete) return;
  std::set<model::LandmarkId> there;
  for (const model::MapLandmark& landmark : map.landmarks) there.insert(landmark.id);

  std::vector<model::LandmarkId> gone;
  for (const auto& [id, submap] : submap_of_) {
    if (submap == 0 && !there.contains(id)) gone.push_back(id);
  }
  for (const model::LandmarkId id : gone) drop(id);
  for (const model::MapLandmark& landmark : map.landmarks) put(landmark, 0);
  version_ = map.version;
}

void LandmarkScene::take(const model::MapDelta& delta) {
  if (delta.base_version == 0 && version_ != 0) clear();
  if (delta.version <= version_) return;
  version_ = delta.version;
  for (const model::MapLandmark& landmark : delta.added) put(landmark, 0);
  for (const model::MapLandmark& landmark : delta.moved) put(landmark, 0);
  for (const model::LandmarkId id : delta.removed) drop(id);
  for (const auto& [old_id, new_id] : delta.merged) drop(old_id);
}

void LandmarkScene::take(const model::MapUpdate& update) {
  if (update.status == model::MapUpdateStatus::kFirstMap) clear();
}

void LandmarkScene::take(const model::Submap& submap) {
  for (const model::SubmapId replaced : submap.replaced) {
    std::vector<model::LandmarkId> gone;
    for (auto block = blocks_.lower_bound({replaced, 0});
         block != blocks_.end() && block->first.submap == replaced; ++block) {
      for (const auto& [id, shown] : block->second) gone.push_back(id);
    }
    for (const model::LandmarkId id : gone) drop(id);
  }
  for (const model::MapLandmark& landmark : submap.landmarks) put(landmark, submap.id);
}

void LandmarkScene::take(const model::Existence& existence) {
  for (const model::LandmarkExistence& one : existence.landmarks) {
    const auto submap = submap_of_.find(one.id);
    if (submap == submap_of_.end()) continue;
    const BlockId block = block_of(one.id, submap->second);
    Shown& shown = blocks_.at(block).at(one.id);
    const double probability =
        std::round(one.probability * 50.0) / 50.0;  // Colours in steps of 2 %.
    if (shown.probability == probability && shown.is_in_use == one.is_in_use) continue;
    shown.probability = probability;
    shown.is_in_use = one.is_in_use;
    changed_.insert(block);
  }
}

std::string LandmarkScene::update(model::Utime utime) {
  if (was_cleared_) {
    std::string all = whole(utime);
    skip_update();
    return all;
  }

  JsonText out;
  out.begin_object();
  out.key("deletions");
  out.begin_array();
  for (const BlockId& id : changed_) {
    if (!blocks_.contains(id)) append_deletion(out, utime, false, name_of(id));
  }
  out.end_array();
  out.key("entities");
  out.begin_array();
  for (const BlockId& id : changed_) {
    const auto block = blocks_.find(id);
    if (block != blocks_.end()) append_entity(out, utime, id, block->second);
  }
  out.end_array();
  out.end_object();
  skip_update();
  return out.take();
}

void LandmarkScene::skip_update() {
  changed_.clear();
  was_cleared_ = false;
}

std::string LandmarkScene::whole(model::Utime utime) const {
  JsonText out;
  out.begin_object();
  out.key("deletions");
  out.begin_array();
  append_deletion(out, utime, true, "");
  out.end_array();
  out.key("entities");
  out.begin_array();
  for (const auto& [id, block] : blocks_) append_entity(out, utime, id, block);
  out.end_array();
  out.end_object();
  return out.take();
}

LandmarkScene::BlockId LandmarkScene::block_of(model::LandmarkId id, std::uint64_t submap) {
  return {submap, id >> kBlockBits};
}

std::string LandmarkScene::name_of(const BlockId& id) {
  const model::LandmarkId first = id.number << kBlockBits;
  const model::LandmarkId counter =
      first & ((model::LandmarkId{1} << model::kLandmarkCounterBits) - 1);
  return fmt::format("map{}/{}/{}", model::map_of(first), submap_frame(id.submap), counter);
}

void LandmarkScene::clear() {
  blocks_.clear();
  submap_of_.clear();
  changed_.clear();
  was_cleared_ = true;
  version_ = 0;
  left_out_ = 0;
}

void LandmarkScene::put(const model::MapLandmark& landmark, std::uint64_t submap) {
  Shown shown{{millimetres(landmark.position_m.x()), millimetres(landmark.position_m.y())},
              millimetres(landmark.radius_m),
              landmark.kind};
  const auto known = submap_of_.find(landmark.id);
  if (known == submap_of_.end()) {
    if (submap_of_.size() >= most_) {
      ++left_out_;
      return;
    }
  } else {
    const Shown& before = blocks_.at(block_of(landmark.id, known->second)).at(landmark.id);
    const bool is_same = known->second == submap && before.position_m == shown.position_m &&
                         before.radius_m == shown.radius_m && before.kind == shown.kind;
    if (is_same) return;
    shown.probability = before.probability;
    shown.is_in_use = before.is_in_use;
    if (known->second != submap) drop(landmark.id);
  }

  const BlockId block = block_of(landmark.id, submap);
  submap_of_[landmark.id] = submap;
  blocks_[block][landmark.id] = shown;
  changed_.insert(block);
}

void LandmarkScene::drop(model::LandmarkId id) {
  const auto known = submap_of_.find(id);
  if (known == submap_of_.end()) return;
  const auto block = blocks_.find(block_of(id, known->second));
  changed_.insert(block->first);
  block->second.erase(id);
  if (block->second.empty()) blocks_.erase(block);
  submap_of_.erase(known);
}

void LandmarkScene::append_entity(JsonText& out, model::Utime utime, const BlockId& id,
                                  const Block& block) const {
  const std::string frame = id.submap == 0 ? std::string(kMapFrame) : submap_frame(id.submap);
  entity_value(out, utime, frame, name_of(id), drawn(block));
}

}  // namespace understory::foxglove
