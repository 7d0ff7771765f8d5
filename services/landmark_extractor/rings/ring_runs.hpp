// Cuts each ring into objects: runs of beams whose returns are neighbours in space.
#pragma once

#include <cstdint>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/segments.hpp"
#include "services/landmark_extractor/rings/ring_cloud.hpp"

namespace understory::landmark_extractor::rings {

/// Fewest points of a straight segment of a wall.
inline constexpr std::size_t kLeastOfWall = 5;

/// Points first..last (inclusive) of the cloud, all of one ring and above the ground.
struct Run {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  std::uint16_t ring = 0;                           ///< Ring of all its points.
  planar::Border right = planar::Border::kUnknown;  ///< Before `first`.
  planar::Border left = planar::Border::kUnknown;   ///< After `last`.
  bool is_right_silent = false;                     ///< The next beam on that side gave no return.
  bool is_left_silent = false;                      ///< The same on the other side.
  float met = 0.0F;        ///< Beams that certainly hit its surface, without the first.
  float lost = 0.0F;       ///< Those of them without a return.
  float width_m = 0.0F;    ///< As seen from the sensor, with half a beam on each side.
  float nearest_m = 0.0F;  ///< Least range.
  float z_m = 0.0F;        ///< Mean.
  float height_m = 0.0F;   ///< Above ground, mean.
  float x_m = 0.0F;        ///< Of the centre if it is round, frame `vehicle_level`.
  float y_m = 0.0F;

  /// Number of points on it.
  std::size_t size() const { return last - first + 1; }
  /// Its edge is measured on at least one side, and nothing is adjacent on the other.
  bool stands_alone() const {
    return (right == planar::Border::kClear && left != planar::Border::kCrowded) ||
           (left == planar::Border::kClear && right != planar::Border::kCrowded);
  }
};

/// Adds the runs of one ring that may belong to a trunk or a wall, in order of azimuth.
/// Precondition: order() was called for the ring.
void find_runs(const RingCloud& cloud, const SweepParameters& parameters, std::size_t ring,
               std::vector<Run>& runs);

}  // namespace understory::landmark_extractor::rings
