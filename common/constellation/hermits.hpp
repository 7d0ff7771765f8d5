// Landmarks of a crowd that stand alone in it, and their triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/constellation/triangle_net.hpp"

namespace understory::constellation {

/// Where landmarks stand closer together than they are observed exactly, the triangles among
/// nearest neighbours are all alike, and an observation has other neighbours than the map. A
/// landmark with nobody around it is told from its neighbours all the same, and the next of its
/// kind is far enough away for side lengths that tell places apart.
///
/// A hermit has no landmark within `apart_m` and a crowd of at least kCrowd within kAround times
/// that; so a map without crowds has none, and costs 24 bytes for each landmark. Whether a
/// landmark is one follows from the set of landmarks alone, not from the order of changes.
class Hermits {
 public:
  static constexpr double kAround = 4.0;       ///< Radius of the crowd, in `apart_m`.
  static constexpr std::uint32_t kCrowd = 16;  ///< Landmarks in it.

  /// Of landmarks that stand at least `apart_m` [m] from all others.
  Hermits(double apart_m, const MapParameters& parameters) : apart_m_(apart_m), net_(parameters) {}

  /// Follows a landmark that `grid` holds now. Cost: landmarks within kAround * apart_m, and what
  /// TriangleNet takes for those that are hermits or cease to be.
  void inserted(Slot slot, LandmarkId id, const PointGrid& grid);
  /// Follows a landmark that `grid` no longer holds, and that was at `position_m`.
  void removed(Slot slot, const Eigen::Vector2d& position_m, const PointGrid& grid);

  /// Follows a landmark that was at `before_m` and that `grid` holds elsewhere now.
  void moved(Slot slot, LandmarkId id, const Eigen::Vector2d& before_m, const PointGrid& grid);

  /// Distance that they keep [m].
  double apart_m() const { return apart_m_; }
  /// Their triangles by side lengths; vertices are slots.
  const TriangleIndex& triangles() const { return net_.triangles(); }
  /// Memory held [bytes].
  std::size_t bytes() const { return net_.bytes() + seen_.capacity() * sizeof(Surroundings); }

 private:
  struct Surroundings {
    std::uint32_t near = 0;    ///< Landmarks within apart_m.
    std::uint32_t around = 0;  ///< Landmarks within kAround * apart_m.
    LandmarkId id = 0;
    bool is_member = false;  ///< Of the net.
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
