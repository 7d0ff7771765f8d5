// Isolated landmarks in dense areas ("hermits"), and their triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/constellation/triangle_net.hpp"

namespace understory::constellation {

/// Where the distance between landmarks is near the noise of an observation, triangles among
/// nearest neighbours are ambiguous, and the neighbours in the observation and in the map differ.
/// An isolated landmark can still be identified, and triangles among isolated landmarks are large
/// enough to distinguish places.
///
/// A hermit has no other landmark within `apart_m`, but at least kCrowd landmarks within kAround *
/// apart_m. A map without dense areas has no hermits; this class then costs 24 bytes per landmark.
/// Whether a landmark is a hermit follows from the set of landmarks alone, not from the order of
/// changes.
class Hermits {
 public:
  static constexpr double kAround = 4.0;       ///< Radius of the dense area, in units of `apart_m`.
  static constexpr std::uint32_t kCrowd = 16;  ///< Least number of landmarks in it.

  /// Hermits stand at least `apart_m` [m] from all other landmarks.
  Hermits(double apart_m, const MapParameters& parameters) : apart_m_(apart_m), net_(parameters) {}

  /// Call it after `grid` received the landmark. Cost: the landmarks within kAround * apart_m, and
  /// a change of TriangleNet for each one that becomes a hermit or ceases to be one.
  void inserted(Slot slot, LandmarkId id, const PointGrid& grid);
  /// Call it after `grid` lost the landmark that was at `position_m`.
  void removed(Slot slot, const Eigen::Vector2d& position_m, const PointGrid& grid);

  /// Call it after `grid` moved the landmark that was at `before_m`.
  void moved(Slot slot, LandmarkId id, const Eigen::Vector2d& before_m, const PointGrid& grid);

  /// Least distance of a hermit from all other landmarks [m].
  double apart_m() const { return apart_m_; }
  /// Triangles among hermits by side lengths; vertices are slots.
  const TriangleIndex& triangles() const { return net_.triangles(); }
  /// Memory held [bytes].
  std::size_t bytes() const { return net_.bytes() + seen_.capacity() * sizeof(Surroundings); }

 private:
  struct Surroundings {
    std::uint32_t near = 0;    ///< Landmarks within apart_m.
    std::uint32_t around = 0;  ///< Landmarks within kAround * apart_m.
    LandmarkId id = 0;
    bool is_member = false;  ///< Whether it is in `net_`.
  };
  bool is_hermit(const Surroundings& s) const { return s.near == 0 && s.around >= kCrowd; }
  template <class F>
  void for_each_around(Slot slot, const Eigen::Vector2d& position_m, const PointGrid& grid,
                       F&& f) const;
  void settle(Slot slot, const PointGrid& grid);

  double apart_m_;
  TriangleNet net_;
  std::vector<Surroundings> seen_;  // by slot
};

}  // namespace understory::constellation
