#include "services/landmark_extractor/segments.hpp"

#include <cmath>
#include <optional>

namespace understory {
namespace {

/// Distance between the returns of two beams [m] (law of cosines).
double distance(const PlanarScan& scan, std::size_t a, std::size_t b) {
  const double ra = scan.ranges_m[a];
  const double rb = scan.ranges_m[b];
  return std::sqrt(std::max(
      0.0, ra * ra + rb * rb - 2.0 * ra * rb * std::cos(scan.bearing(b) - scan.bearing(a))));
}

bool same_object(const PlanarScan& scan, std::size_t a, std::size_t b,
                 const PlanarTrunkParameters& parameters) {
  const double nearer = std::min(scan.ranges_m[a], scan.ranges_m[b]);
  return distance(scan, a, b) <= parameters.break_distance_m + parameters.break_per_range * nearer;
}

/// What lies beyond the beam `edge` of an object, at the beam `beyond`.
Border border(const PlanarScan& scan, std::size_t edge, std::size_t beyond,
              const PlanarTrunkParameters& parameters) {
  if (!scan.is_return(beyond)) return Border::kClear;
  const double behind = scan.ranges_m[beyond] - scan.ranges_m[edge];
  if (behind > parameters.clearance_m) return Border::kClear;
  return behind < -parameters.clearance_m ? Border::kOccluded : Border::kCrowded;
}

void find_borders(const PlanarScan& scan, const PlanarTrunkParameters& parameters,
                  Segment& segment) {
  if (segment.first > 0) segment.right = border(scan, segment.first, segment.first - 1, parameters);
  if (segment.last + 1 < scan.ranges_m.size()) {
    segment.left = border(scan, segment.last, segment.last + 1, parameters);
  }
}

}  // namespace

std::vector<Segment> split(const PlanarScan& scan, const PlanarTrunkParameters& parameters) {
  std::vector<Segment> segments;
  std::optional<Segment> open;
  const auto close = [&] {
    if (!open) return;
    find_borders(scan, parameters, *open);
    segments.push_back(*open);
    open.reset();
  };
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (!scan.is_return(beam)) {
      close();
      continue;
    }
    if (open && !same_object(scan, beam - 1, beam, parameters)) close();
    if (!open) open = Segment{beam, beam};
    open->last = beam;
  }
  close();
  return segments;
}

}  // namespace understory
