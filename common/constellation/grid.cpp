#include "common/constellation/grid.hpp"

#include <cassert>

namespace understory::constellation {

std::uint32_t PointGrid::tile_for(std::uint32_t cx, std::uint32_t cy) {
  const std::uint64_t key = tile_key(cx, cy);
  std::uint32_t tile = directory_.find(key);
  if (tile != IndexTable::kNone) return tile;

  if (free_tiles_.empty()) {
    tile = static_cast<std::uint32_t>(tiles_.size());
    tiles_.emplace_back();
  } else {
    tile = free_tiles_.back();
    free_tiles_.pop_back();
  }

  tiles_[tile].heads.fill(kNoSlot);
  directory_.insert(key, tile);

  return tile;
}

void PointGrid::insert(Slot slot, const Eigen::Vector2d& point) {
  assert(representable(point));
  if (slot >= points_.size()) points_.resize(slot + 1);
  const std::uint32_t cx = cell_of(point.x());
  const std::uint32_t cy = cell_of(point.y());
  Tile& tile = tiles_[tile_for(cx, cy)];
  Slot& head = tile.heads[index_in_tile(cx, cy)];
  points_[slot] = {point.x(), point.y(), head, true};
  head = slot;
  ++tile.size;
}

void PointGrid::remove(Slot slot) {
  const std::uint32_t cx = cell_of(points_[slot].x);
  const std::uint32_t cy = cell_of(points_[slot].y);
  const std::uint32_t index = directory_.find(tile_key(cx, cy));
  Tile& tile = tiles_[index];
  Slot* link = &tile.heads[index_in_tile(cx, cy)];
  while (*link != slot) link = &points_[*link].next;
  *link = points_[slot].next;
  points_[slot].is_used = false;
  if (--tile.size == 0) {
    directory_.erase(tile_key(cx, cy));
    free_tiles_.push_back(index);
  }
}

void PointGrid::move(Slot slot, const Eigen::Vector2d& point) {
  if (cell_of(point.x()) == cell_of(points_[slot].x) &&
      cell_of(point.y()) == cell_of(points_[slot].y)) {
    points_[slot].x = point.x();
    points_[slot].y = point.y();
    return;
  }
  remove(slot);
  insert(slot, point);
}

}  // namespace understory::constellation
