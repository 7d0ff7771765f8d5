// Cuts a planar scan into objects: runs of beams whose returns are neighbours in space.
#pragma once

#include <cstddef>
#include <vector>

#include "common/model/planar_scan.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory {

/// What bounds an object on one side.
enum class Border : std::uint8_t {
  kClear = 0,     ///< Nothing, or something well behind: the object's own edge is seen.
  kOccluded = 1,  ///< Something well in front: the object goes on behind it, unseen.
  kCrowded = 2,   ///< Something about as far away: not an object that stands alone.
  kUnknown = 3,   ///< The end of the scan.
};

/// Beams first..last (both included), all with a return.
struct Segment {
  std::size_t first = 0;
  std::size_t last = 0;
  Border right = Border::kUnknown;  ///< Before `first`.
  Border left = Border::kUnknown;   ///< After `last`.

  std::size_t size() const { return last - first + 1; }
};

/// All segments in order of bearing.
std::vector<Segment> split(const PlanarScan& scan, const PlanarTrunkParameters& parameters);

}  // namespace understory
