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

/// Points first..last (both included) of the cloud, all of one ring and above the ground.
struct Run {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  std::uint16_t ring = 0;                           ///< That all are of.
  planar::Border right = planar::Border::kUnknown;  ///< Before `first`.
  planar::Border left = planar::Border::kUnknown;   ///< After `last`.
  bool is_right_silent = false;  ///< The next beam on that side gave no return at all.
  bool is_left_silent = false;   ///< The same on the other side.
  float met = 0.0F;              ///< Beams that met its surface beyond doubt, but its first.
  float lost = 0.0F;             ///< Those of them without a return.
  float width_m = 0.0F;          ///< As seen from the sensor, with half a beam on each side.
  float nearest_m = 0.0F;        ///< Least range.
  float z_m = 0.0F;              ///< Mean.
  float height_m = 0.0F;         ///< Above ground, mean.
  float x_m = 0.0F;              ///< Of the centre if it is round, frame `vehicle_level`.
  float y_m = 0.0F;

  /// Points on it.
  std::size_t size() const { return last - first + 1; }
  /// Its own edge is measured on at least one side, and nothing touches it on the other.
  bool stands_alone() const {
    return (right == planar::Border::kClear && left != planar::Border::kCrowded) ||
           (left == planar::Border::kClear && right != planar::Border::kCrowded);
  }
};

/// Adds the runs of one ring that may be of a trunk or a wall, in order of azimuth. Precondition:
/// order() was called for the ring.
void find_runs(const RingCloud& cloud, const SweepParameters& parameters, std::size_t ring,
               std::vector<Run>& runs);

}  // namespace understory::landmark_extractor::rings
