// The triangles that landmarks form with their nearest neighbours, kept up to date while landmarks
// change.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/constellation/localisation.hpp"
#include "common/constellation/triangles.hpp"

namespace understory::constellation {

/// Sizes of the look-up structures of a map. They decide speed and memory; max_neighbour_distance_m
/// also decides which triangles exist.
struct MapParameters {
  double cell_m = 4.0;    ///< Cell of the grid.
  double bucket_m = 0.5;  ///< Bucket of side lengths.
  /// Neighbours further away than this form no triangles [m].
  double max_neighbour_distance_m = 30.0;
};

/// Landmarks by slot: their positions in a grid, each one's nearest neighbours, and the triangles
/// that follow. A change costs only its neighbourhood, and the result does not depend on the order
/// of changes (ties between distances are broken by id). The caller assigns slots, densely from 0.
class TriangleNet {
 public:
  /// Triangles are formed of a landmark and two of this many nearest neighbours.
  static constexpr std::size_t kNeighbours = 6;

  /// An empty net.
  explicit TriangleNet(const MapParameters& parameters);

  /// Adds a landmark. Preconditions: the slot is free, the position representable by the grid.
  void insert(Slot slot, LandmarkId id, const Eigen::Vector2d& position_m);
  /// Removes a landmark. Precondition: the slot is in use.
  void remove(Slot slot);
  /// Gives a landmark a new position. Preconditions: as of insert() and remove().
  void move(Slot slot, const Eigen::Vector2d& position_m);

  /// Positions by slot.
  const PointGrid& grid() const { return grid_; }
  /// Triangles by side lengths; vertices are slots.
  const TriangleIndex& triangles() const { return triangles_; }
  /// Id of the landmark in a slot in use.
  LandmarkId id_of(Slot slot) const { return ids_[slot]; }
  /// Slots given out so far, free ones included.
  std::size_t slot_count() const { return ids_.size(); }
  /// Memory held [bytes].
  std::size_t bytes() const;

 private:
  using SlotTriple = std::array<Slot, 3>;
  struct Neighbours {
    std::array<Slot, kNeighbours> slot{};
    std::uint32_t count = 0;
    bool has(Slot wanted) const;
  };

  Neighbours nearest_neighbours(Slot slot) const;
  /// Landmarks that have, or would have, a landmark `slot` at `position` among their neighbours.
  void collect_anchors(Slot slot, const Eigen::Vector2d& position,
                       std::vector<Slot>& anchors) const;
  /// Triangles of the anchors' neighbourhoods with this corner: sorted, each once.
  std::vector<SlotTriple> triangles_at(Slot corner, const std::vector<Slot>& anchors) const;
  /// Triangles of `anchor` that exist with the neighbours `in` and not with `out`, without
  /// `except`.
  static void collect_difference(Slot anchor, const Neighbours& in, const Neighbours& out,
                                 Slot except, std::vector<SlotTriple>& triangles);
  static bool holds(Slot anchor, const Neighbours& list, const SlotTriple& triangle);
  Triangle canonical(const SlotTriple& triangle) const;
  /// Brings neighbourhoods and triangles up to date around `changed` and calls `change` between;
  /// `gone` is `changed` if the landmark is removed.
  template <class Change>
  void update(Slot changed, std::vector<Slot>& anchors, Change&& change, Slot gone = kNoSlot);
  /// Of the triangles without the corner `changed`, removes and adds those by which the anchors'
  /// old and new lists of neighbours differ.
  void exchange_others(Slot changed, const std::vector<Slot>& anchors,
                       const std::vector<Neighbours>& lists_before);

  MapParameters parameters_;
  PointGrid grid_;
  TriangleIndex triangles_;
  std::vector<LandmarkId> ids_;         // by slot
  std::vector<Neighbours> neighbours_;  // by slot
};

}  // namespace understory::constellation
