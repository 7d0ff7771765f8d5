// Cuts a planar scan into objects: runs of beams whose returns are neighbours in space.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/beams.hpp"

namespace understory::landmark_extractor::planar {

/// What bounds an object on one side.
enum class Border : std::uint8_t {
  kClear = 0,     ///< Nothing, or something well behind: the object's own edge is measured.
  kOccluded = 1,  ///< Something well in front: the object goes on behind it, unseen.
  kCrowded = 2,   ///< Something about as far away: not an object that stands alone.
  kUnknown = 3,   ///< The end of the scan.
};

/// An object: beams first..last (both included) of a scan, all with a return.
struct Segment {
  std::size_t first = 0;            ///< Rightmost beam.
  std::size_t last = 0;             ///< Leftmost beam.
  Border right = Border::kUnknown;  ///< Before `first`.
  Border left = Border::kUnknown;   ///< After `last`.

  /// Beams on it.
  std::size_t size() const { return last - first + 1; }
};

/// All objects of a scan, in order of bearing.
std::vector<Segment> split(const Beams& scan, const PlanarTrunkParameters& parameters);

/// Whether the object lies on the straight line between the returns of the beams beside it. So does
/// every part of a wall or fence at a grazing angle and falls apart into single
/// beams.
bool continues_a_line(const Beams& scan, const Segment& segment, double tolerance_m);

/// Distance from segments[index] to the nearest other object [m], over their returns; infinity
/// where nothing else is within `radius_m`.
double nearest_object(const Beams& scan, const std::vector<Segment>& segments, std::size_t index,
                      double radius_m);

}  // namespace understory::landmark_extractor::planar
