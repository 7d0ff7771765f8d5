// Points in square cells: nearest neighbours in constant time, changed in place.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/constellation/table.hpp"

namespace understory::constellation {

/// Index of a landmark in contiguous storage; reused after a removal.
using Slot = std::uint32_t;
inline constexpr Slot kNoSlot = IndexTable::kNone;

/// A uniform grid over points addressed by slot. Cells are heads of short lists in tiles of 32 x
/// 32; tiles exist only where there are points, so the extent of the map costs no memory.
class PointGrid {
 public:
  /// Largest absolute coordinate of a stored or queried point [m].
  static constexpr double kMaxCoordinate = 2.0e6;

  /// Empty, with cells of `cell_m` [m], > 0. Fastest where a cell holds about one point.
  explicit PointGrid(double cell_m) : cell_m_(cell_m), per_m_(1.0 / cell_m) {}

  /// Whether a point can be stored: finite, and within kMaxCoordinate on both axes.
  static bool representable(const Eigen::Vector2d& point) {
    // Written so that NaN fails.
    return std::abs(point.x()) <= kMaxCoordinate && std::abs(point.y()) <= kMaxCoordinate;
  }

  /// Stores `point` [m] under `slot`; constant time. Preconditions: the slot is not in the grid,
  /// the point is representable.
  void insert(Slot slot, const Eigen::Vector2d& point);
  /// Removes the slot's point; constant time. Precondition: it is in the grid.
  void remove(Slot slot);
  /// Gives the slot's point a new position [m]; constant time. Preconditions as of remove() and
  /// insert().
  void move(Slot slot, const Eigen::Vector2d& point);
  /// Position of the slot's point [m].
  Eigen::Vector2d position(Slot slot) const { return {points_[slot].x, points_[slot].y}; }

  /// Calls f(slot, squared distance [m^2]) for every point within `radius_m` of (x, y), in no
  /// meaningful order. Cost: the cells of the square around the circle, or all points where there
  /// are far more cells than points.
  template <class F>
  void for_each_within(double x, double y, double radius_m, F&& f) const {
    const double squared = radius_m * radius_m;
    const std::uint32_t x_end = cell_of(x + radius_m);
    const std::uint32_t y_begin = cell_of(y - radius_m);
    const std::uint32_t y_end = cell_of(y + radius_m);
    if (has_more_cells(x_end - cell_of(x - radius_m), y_end - y_begin)) {
      for (Slot slot = 0; slot < points_.size(); ++slot) {
        const double dx = points_[slot].x - x;
        const double dy = points_[slot].y - y;
        const double d = dx * dx + dy * dy;
        if (points_[slot].is_used && d <= squared) f(slot, d);
      }
      return;
    }

    std::uint64_t key = ~std::uint64_t{0};
    std::uint32_t tile = IndexTable::kNone;

    for (std::uint32_t cx = cell_of(x - radius_m); cx <= x_end; ++cx) {
      for (std::uint32_t cy = y_begin; cy <= y_end; ++cy) {
        if (tile_key(cx, cy) != key) {  // cells of one tile share its look-up
          key = tile_key(cx, cy);
          tile = directory_.find(key);
        }

        if (tile == IndexTable::kNone) continue;
        Slot slot = tiles_[tile].heads[index_in_tile(cx, cy)];
        for (; slot != kNoSlot; slot = points_[slot].next) {
          const double dx = points_[slot].x - x;
          const double dy = points_[slot].y - y;
          const double d = dx * dx + dy * dy;
          if (d <= squared) f(slot, d);
        }
      }
    }
  }

  /// Calls f(slot, squared distance) for every point in cells at ever larger distance from (x, y),
  /// until `done(r)` holds; all points within r [m] have been visited by then.
  template <class F, class Done>
  void for_each_outward(double x, double y, F&& f, Done&& done) const {
    const auto cx = static_cast<std::int64_t>(cell_of(x));
    const auto cy = static_cast<std::int64_t>(cell_of(y));
    const double inside = distance_to_own_cell_border(x, y);
    for (std::int64_t ring = 0;; ++ring) {
      for (std::int64_t i = cx - ring; i <= cx + ring; ++i) {
        const bool whole_column = i == cx - ring || i == cx + ring;
        const std::int64_t step = whole_column || ring == 0 ? 1 : 2 * ring;
        for (std::int64_t j = cy - ring; j <= cy + ring; j += step) visit(i, j, x, y, f);
      }
      if (done(inside + static_cast<double>(ring) * cell_m_)) return;
    }
  }

  /// Memory held [bytes].
  std::size_t bytes() const {
    return points_.capacity() * sizeof(Point) + tiles_.capacity() * sizeof(Tile) +
           directory_.bytes();
  }

 private:
  static constexpr std::uint32_t kTileBits = 5;
  static constexpr std::uint32_t kTileMask = (1U << kTileBits) - 1;
  static constexpr std::uint32_t kOffset = 1U << 30;

  struct Point {
    double x = 0.0;
    double y = 0.0;
    Slot next = kNoSlot;
    bool is_used = false;
  };
  struct Tile {
    std::array<Slot, std::size_t{1} << (2 * kTileBits)> heads;
    std::uint32_t size = 0;
  };

  /// Truncation of a positive number: floor() would be a call on plain x86-64.
  std::uint32_t cell_of(double coordinate) const {
    return static_cast<std::uint32_t>(
        static_cast<std::int64_t>(coordinate * per_m_ + static_cast<double>(kOffset)));
  }
  double distance_to_own_cell_border(double x, double y) const {
    const auto to_border = [this](double v) {
      const double in_cell =
          v - (static_cast<double>(cell_of(v)) - static_cast<double>(kOffset)) * cell_m_;
      return std::min(in_cell, cell_m_ - in_cell);
    };
    return std::max(0.0, std::min(to_border(x), to_border(y)));
  }
  /// Whether a visit of these columns and rows of cells costs more than one of all points (radii of
  /// kilometres).
  bool has_more_cells(std::uint32_t columns, std::uint32_t rows) const {
    const std::uint64_t cells = std::uint64_t{columns} * rows;
    return cells > 65536 + 4 * std::uint64_t{points_.size()};
  }
  static std::uint64_t tile_key(std::uint32_t cx, std::uint32_t cy) {
    return (std::uint64_t{cx >> kTileBits} << 32) | (cy >> kTileBits);
  }
  static std::uint32_t index_in_tile(std::uint32_t cx, std::uint32_t cy) {
    return ((cx & kTileMask) << kTileBits) | (cy & kTileMask);
  }
  Slot head(std::uint32_t cx, std::uint32_t cy) const {
    const std::uint32_t tile = directory_.find(tile_key(cx, cy));
    return tile == IndexTable::kNone ? kNoSlot : tiles_[tile].heads[index_in_tile(cx, cy)];
  }
  template <class F>
  void visit(std::int64_t cx, std::int64_t cy, double x, double y, F&& f) const {
    Slot slot = head(static_cast<std::uint32_t>(cx), static_cast<std::uint32_t>(cy));
    for (; slot != kNoSlot; slot = points_[slot].next) {
      const double dx = points_[slot].x - x;
      const double dy = points_[slot].y - y;
      f(slot, dx * dx + dy * dy);
    }
  }
  std::uint32_t tile_for(std::uint32_t cx, std::uint32_t cy);

  double cell_m_;
  double per_m_;
  std::vector<Point> points_;  // by slot
  std::vector<Tile> tiles_;
  std::vector<std::uint32_t> free_tiles_;
  IndexTable directory_;
};

}  // namespace understory::constellation
