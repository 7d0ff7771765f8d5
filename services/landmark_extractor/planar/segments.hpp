// Cuts a planar scan into objects: runs of beams whose returns are neighbours in space.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/beams.hpp"

namespace understory::landmark_extractor::planar {

/// Surroundings of an object on one side.
enum class Border : std::uint8_t {
  kClear = 0,     ///< No return, or one well behind: the object's own edge is measured.
  kOccluded = 1,  ///< A return well in front: the object continues behind it, hidden.
  kCrowded = 2,   ///< A return at about the same distance: the object is not isolated.
  kUnknown = 3,   ///< The end of the scan.
};

/// An object: beams first..last (inclusive) of a scan, all with a return.
struct Segment {
  std::size_t first = 0;            ///< Rightmost beam.
  std::size_t last = 0;             ///< Leftmost beam.
  Border right = Border::kUnknown;  ///< Before `first`.
  Border left = Border::kUnknown;   ///< After `last`.

  /// Number of beams on it.
  std::size_t size() const { return last - first + 1; }
};

/// All objects of a scan, in order of bearing.
std::vector<Segment> split(const Beams& scan, const PlanarTrunkParameters& parameters);

/// Whether the object lies on the straight line between the returns of the neighbouring beams. So
/// does each single beam on a wall or fence at a grazing angle.
bool continues_a_line(const Beams& scan, const Segment& segment, double tolerance_m);

/// Distance from segments[index] to the nearest other object [m], over their returns; infinity if
/// there is none within `radius_m`.
double nearest_object(const Beams& scan, const std::vector<Segment>& segments, std::size_t index,
                      double radius_m);

}  // namespace understory::landmark_extractor::planar
