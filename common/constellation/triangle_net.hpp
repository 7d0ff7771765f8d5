// The triangles that landmarks form with their nearest neighbours, kept true while landmarks
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

/// Sizes of the look-up structures of a map. They decide speed and memory; the last one also
/// decides which triangles exist.
struct MapParameters {
  double cell_m = 4.0;    ///< Of the grid.
  double bucket_m = 0.5;  ///< Of side lengths.
  /// Neighbours further away than this form no triangles [m].
  double max_neighbour_distance_m = 30.0;
};

/// Landmarks by slot: their positions in a grid, each one's nearest neighbours, and the triangles
/// that follow. A change costs what it touches, and the result does not depend on the order of
/// changes (ties between distances are broken by id). Slots are given out by the caller, densely
/// from 0.
class TriangleNet {
 public:
  /// Triangles are made among a landmark and two of its so many nearest neighbours.
  static constexpr std::size_t kNeighbours = 6;

  /// Without landmarks.
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
  /// Landmarks whose neighbours a landmark `slot` at `position` is, or would be.
  void collect_anchors(Slot slot, const Eigen::Vector2d& position,
                       std::vector<Slot>& anchors) const;
  /// Triangles with that corner that the anchors' neighbourhoods hold: sorted, each once.
  std::vector<SlotTriple> triangles_at(Slot corner, const std::vector<Slot>& anchors) const;
  /// Triangles that `anchor` holds with the neighbours `in` and not with `out`, without `except`.
  static void collect_difference(Slot anchor, const Neighbours& in, const Neighbours& out,
                                 Slot except, std::vector<SlotTriple>& triangles);
  static bool holds(Slot anchor, const Neighbours& list, const SlotTriple& triangle);
  Triangle canonical(const SlotTriple& triangle) const;
  /// Brings neighbourhoods and triangles up to date around `changed` while `change` is made; `gone`
  /// is `changed` if it is no longer there afterwards.
  template <class Change>
  void update(Slot changed, std::vector<Slot>& anchors, Change&& change, Slot gone = kNoSlot);
  /// Removes and adds the triangles without the corner `changed` that the anchors' new lists of
  /// neighbours no longer hold, or newly hold.
  void exchange_others(Slot changed, const std::vector<Slot>& anchors,
                       const std::vector<Neighbours>& lists_before);

  MapParameters parameters_;
  PointGrid grid_;
  TriangleIndex triangles_;
  std::vector<LandmarkId> ids_;         // by slot
  std::vector<Neighbours> neighbours_;  // by slot
};

}  // namespace understory::constellation
