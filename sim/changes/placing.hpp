// Free space in a scene, and placing of things.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "sim/changes/scene.hpp"

namespace understory::sim::changes {

/// Whether two boxes are nearer to each other than `gap_m` in the plan (the exact distance if sides
/// face each other, slightly more at corners) and overlap in height.
bool are_close(const Box& a, const Box& b, double gap_m);
/// Whether the box is within the scene's bounds in the plan; in a forest, its middle.
bool is_within(const Scene& scene, const Box& box);
/// Distance from a point to a box [m]; 0 inside.
double distance_m(const Box& box, const Eigen::Vector3d& point_m);

/// The occupied space: by things, and by the path, which must stay free.
class FreeSpace {
 public:
  /// `path_m`: closely spaced positions of the body; things keep a distance of `clearance_m`.
  FreeSpace(std::span<const Eigen::Vector3d> path_m, double clearance_m, double gap_m)
      : path_m_(path_m.begin(), path_m.end()), clearance_m_(clearance_m), gap_m_(gap_m) {}

  /// Whether the box has room.
  bool has_room(const Box& box) const;
  /// Marks the box as occupied.
  void take(const Box& box) { taken_.push_back(box); }
  /// Positions of the path.
  std::span<const Eigen::Vector3d> path_m() const { return path_m_; }
  /// Least distance between the path and a thing.
  double clearance_m() const { return clearance_m_; }

 private:
  std::vector<Eigen::Vector3d> path_m_;
  double clearance_m_;
  double gap_m_;
  std::vector<Box> taken_;
};

/// The free space of a scene: all things but the structure occupy space.
FreeSpace free_space(const Scene& scene, std::span<const Eigen::Vector3d> path_m);

/// A thing of this kind at a plausible place in the scene (a rack at a wall, a car beside the
/// path), ignoring other things.
Thing propose(const Scene& scene, ThingKind kind, std::span<const Eigen::Vector3d> path_m,
              std::mt19937_64& random);
/// The first proposal with room; none after `tries`. Its space is marked as occupied.
std::optional<Thing> place(const Scene& scene, ThingKind kind, FreeSpace& space,
                           std::mt19937_64& random, int tries = 400);

}  // namespace understory::sim::changes
