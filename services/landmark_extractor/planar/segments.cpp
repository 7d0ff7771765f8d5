#include "services/landmark_extractor/planar/segments.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace understory::landmark_extractor::planar {
namespace {

/// Distance between the returns of two beams [m] (law of cosines).
double distance(const model::PlanarScan& scan, std::size_t a, std::size_t b) {
  const double ra = scan.ranges_m[a];
  const double rb = scan.ranges_m[b];
  return std::sqrt(std::max(
      0.0, ra * ra + rb * rb - 2.0 * ra * rb * std::cos(scan.bearing(b) - scan.bearing(a))));
}

bool same_object(const model::PlanarScan& scan, std::size_t a, std::size_t b,
                 const PlanarTrunkParameters& parameters) {
  const double nearer = std::min(scan.ranges_m[a], scan.ranges_m[b]);
  return distance(scan, a, b) <= parameters.break_distance_m + parameters.break_per_range * nearer;
}

/// What lies beyond the beam `edge` of an object, at the beam `beyond`.
Border border(const model::PlanarScan& scan, std::size_t edge, std::size_t beyond,
              const PlanarTrunkParameters& parameters) {
  if (!scan.is_return(beyond)) return Border::kClear;
  const double behind = scan.ranges_m[beyond] - scan.ranges_m[edge];
  if (behind > parameters.clearance_m) return Border::kClear;
  return behind < -parameters.clearance_m ? Border::kOccluded : Border::kCrowded;
}

void find_borders(const model::PlanarScan& scan, const PlanarTrunkParameters& parameters,
                  Segment& segment) {
  if (segment.first > 0) segment.right = border(scan, segment.first, segment.first - 1, parameters);
  if (segment.last + 1 < scan.ranges_m.size()) {
    segment.left = border(scan, segment.last, segment.last + 1, parameters);
  }
}

Eigen::Vector2d point(const model::PlanarScan& scan, std::size_t beam) {
  const double bearing = scan.bearing(beam);
  return scan.ranges_m[beam] * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
}

double distance(const model::PlanarScan& scan, const Segment& a, const Segment& b) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = a.first; i <= a.last; ++i) {
    for (std::size_t j = b.first; j <= b.last; ++j) least = std::min(least, distance(scan, i, j));
  }
  return least;
}

/// Whether the bearing between two beams is so wide that nothing at `range` is within `radius`.
bool too_wide(const model::PlanarScan& scan, std::size_t a, std::size_t b, double range,
              double radius) {
  return range * std::sin(std::min(1.5, scan.bearing(b) - scan.bearing(a))) > radius;
}

}  // namespace

std::vector<Segment> split(const model::PlanarScan& scan, const PlanarTrunkParameters& parameters) {
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

bool continues_a_line(const model::PlanarScan& scan, const Segment& segment, double tolerance_m) {
  if (segment.first == 0 || segment.last + 1 >= scan.ranges_m.size()) return false;
  const std::size_t before = segment.first - 1;
  const std::size_t after = segment.last + 1;
  if (!scan.is_return(before) || !scan.is_return(after)) return false;
  const Eigen::Vector2d start = point(scan, before);
  const Eigen::Vector2d along = (point(scan, after) - start).normalized();
  for (std::size_t beam = segment.first; beam <= segment.last; ++beam) {
    const Eigen::Vector2d offset = point(scan, beam) - start;
    if (std::abs(along.x() * offset.y() - along.y() * offset.x()) > tolerance_m) return false;
  }
  return true;
}

double nearest_object(const model::PlanarScan& scan, const std::vector<Segment>& segments,
                      std::size_t index, double radius_m) {
  const Segment& own = segments[index];
  const double range =
      *std::min_element(scan.ranges_m.begin() + static_cast<std::ptrdiff_t>(own.first),
                        scan.ranges_m.begin() + static_cast<std::ptrdiff_t>(own.last) + 1);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = index; i-- > 0;) {
    if (too_wide(scan, segments[i].last, own.first, range, radius_m)) break;
    least = std::min(least, distance(scan, segments[i], own));
  }
  for (std::size_t i = index + 1; i < segments.size(); ++i) {
    if (too_wide(scan, own.last, segments[i].first, range, radius_m)) break;
    least = std::min(least, distance(scan, own, segments[i]));
  }
  return least <= radius_m ? least : std::numeric_limits<double>::infinity();
}

}  // namespace understory::landmark_extractor::planar
