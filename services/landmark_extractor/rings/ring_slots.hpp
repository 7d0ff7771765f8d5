// Memory for the points of all rings, and the order in which they go into it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/points/point_blocks.hpp"

namespace understory::landmark_extractor::rings {

/// What was wrong with the points of a sweep.
struct PointCounters {
  std::uint64_t not_finite = 0;
  std::uint64_t bad_ring = 0;  ///< A ring that the sensor does not have.
};

/// First index and the one behind the last.
struct IndexRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// A slot of memory per ring, twice as long as the ring at least, so that its first points can be
/// moved behind its last ones. A ring that rotates to the right fills its slot from behind: azimuth
/// grows with the index either way. Keeps its memory from sweep to sweep.
class RingSlots {
 public:
  /// Levels the points and puts each into its ring's slot. `is_leftward`: how the sensor rotates,
  /// seen from above. Points out of range are in no ring; what is wrong is counted.
  void fill(const model::PointSweep& sweep, const points::Levelling& levelling, bool is_leftward,
            const ground::GroundSurface& ground, PointCounters& counters);
  /// Moves the ring's first points behind its last so that no object lies on both of its ends, and
  /// gives the ring's place. Once per ring after fill(). What is lower than `lowest_m` above ground
  /// is no object.
  IndexRange cut(std::size_t ring, float lowest_m);

  /// Of all slots.
  std::span<const points::RingPoint> points() const { return {points_.get(), capacity_}; }
  /// Those that are farther than the range, in the order of the sweep; their height above ground
  /// means nothing.
  std::span<const points::RingPoint> far_points() const { return far_; }

 private:
  /// One ring while its points come in.
  struct Filling {
    points::RingPoint* next = nullptr;  ///< Where the next point goes.
    points::RingPoint* full = nullptr;  ///< Where there is no more place.
    float azimuth_rad = 0.0F;           ///< Of the last point; NaN = none yet.
    float turned_rad = 0.0F;            ///< Whole revolutions since the ring's first point.
  };

  void reserve(std::size_t rings, std::size_t points_per_ring);
  /// False when a ring has more points than its slot takes.
  bool scatter(const model::PointSweep& sweep, const points::Levelling& levelling,
               const ground::GroundSurface& ground, PointCounters& counters);

  points::PointBlock block_;
  std::unique_ptr<points::RingPoint[]> points_;
  std::size_t capacity_ = 0;
  std::size_t slot_ = 0;  ///< Points from slot to slot.
  std::vector<Filling> filling_;
  std::vector<points::RingPoint> far_;
  bool is_leftward_ = true;
};

}  // namespace understory::landmark_extractor::rings
