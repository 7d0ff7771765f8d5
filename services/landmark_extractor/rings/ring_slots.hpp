// Memory for the points of all rings, and their order in it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/points/point_blocks.hpp"

namespace understory::landmark_extractor::rings {

/// Counts of invalid points of a sweep.
struct PointCounters {
  std::uint64_t not_finite = 0;
  std::uint64_t bad_ring = 0;  ///< A ring that the sensor does not have.
};

/// First index, and one beyond the last.
struct IndexRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// A slot of memory per ring, at least twice as long as the ring, so that its first points can be
/// moved behind its last ones. A ring that rotates to the right fills its slot from the end: so the
/// azimuth always grows with the index. Reuses memory between sweeps.
class RingSlots {
 public:
  /// Levels the points and puts each into its ring's slot. `is_leftward`: rotation of the sensor,
  /// seen from above. Points out of range are in no ring; invalid ones are counted.
  void fill(const model::PointSweep& sweep, const points::Levelling& levelling, bool is_leftward,
            const ground::GroundSurface& ground, PointCounters& counters);
  /// Moves the ring's first points behind its last so that no object is divided between its two
  /// ends, and returns the ring's range of indices. Once per ring after fill(). Points lower than
  /// `lowest_m` above ground belong to no object.
  IndexRange cut(std::size_t ring, float lowest_m);

  /// Of all slots.
  std::span<const points::RingPoint> points() const { return {points_.get(), capacity_}; }
  /// Points beyond the range, in the order of the sweep; their height above ground is undefined.
  std::span<const points::RingPoint> far_points() const { return far_; }

 private:
  /// One ring while it is filled.
  struct Filling {
    points::RingPoint* next = nullptr;  ///< Position of the next point.
    points::RingPoint* full = nullptr;  ///< End of the slot.
    float azimuth_rad = 0.0F;           ///< Of the last point; NaN = none yet.
    float turned_rad = 0.0F;            ///< Whole revolutions since the ring's first point.
  };

  void reserve(std::size_t rings, std::size_t points_per_ring);
  /// False if a ring has more points than its slot.
  bool scatter(const model::PointSweep& sweep, const points::Levelling& levelling,
               const ground::GroundSurface& ground, PointCounters& counters);

  points::PointBlock block_;
  std::unique_ptr<points::RingPoint[]> points_;
  std::size_t capacity_ = 0;
  std::size_t slot_ = 0;  ///< Points per slot.
  std::vector<Filling> filling_;
  std::vector<points::RingPoint> far_;
  bool is_leftward_ = true;
};

}  // namespace understory::landmark_extractor::rings
