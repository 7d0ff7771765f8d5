#include "services/landmark_extractor/planar/segments.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace understory::landmark_extractor::planar {
namespace {

/// Distance between the returns of two beams [m].
double distance(const Beams& scan, std::size_t a, std::size_t b) {
  return (scan.beams[a].point_m - scan.beams[b].point_m).norm();
}

bool same_object(const Beams& scan, std::size_t a, std::size_t b,
                 const PlanarTrunkParameters& parameters) {
  const double nearer = std::min(scan.beams[a].range_m, scan.beams[b].range_m);
  return distance(scan, a, b) <= parameters.break_distance_m + parameters.break_per_range * nearer;
}

/// Border of an object beyond its beam `edge`, at the beam `beyond`.
Border border(const Beams& scan, std::size_t edge, std::size_t beyond,
              const PlanarTrunkParameters& parameters) {
  if (!scan.beams[beyond].is_return()) return Border::kClear;
  const double behind = scan.beams[beyond].range_m - scan.beams[edge].range_m;
  if (behind > parameters.clearance_m) return Border::kClear;
  return behind < -parameters.clearance_m ? Border::kOccluded : Border::kCrowded;
}

void find_borders(const Beams& scan, const PlanarTrunkParameters& parameters, Segment& segment) {
  if (segment.first > 0) segment.right = border(scan, segment.first, segment.first - 1, parameters);
  if (segment.last + 1 < scan.beams.size()) {
    segment.left = border(scan, segment.last, segment.last + 1, parameters);
  }
}

double distance(const Beams& scan, const Segment& a, const Segment& b) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = a.first; i <= a.last; ++i) {
    for (std::size_t j = b.first; j <= b.last; ++j) least = std::min(least, distance(scan, i, j));
  }
  return least;
}

/// Whether the bearing between two beams is so large that no point at `range` is within `radius`.
bool too_wide(const Beams& scan, std::size_t a, std::size_t b, double range, double radius) {
  return range * std::sin(std::min(1.5, scan.beams[b].bearing_rad - scan.beams[a].bearing_rad)) >
         radius;
}

}  // namespace

std::vector<Segment> split(const Beams& scan, const PlanarTrunkParameters& parameters) {
  std::vector<Segment> segments;
  std::optional<Segment> open;
  const auto close = [&] {
    if (!open) return;
    find_borders(scan, parameters, *open);
    segments.push_back(*open);
    open.reset();
  };
  for (std::size_t beam = 0; beam < scan.beams.size(); ++beam) {
    if (!scan.beams[beam].is_return()) {
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

bool continues_a_line(const Beams& scan, const Segment& segment, double tolerance_m) {
  if (segment.first == 0 || segment.last + 1 >= scan.beams.size()) return false;
  const std::size_t before = segment.first - 1;
  const std::size_t after = segment.last + 1;
  if (!scan.beams[before].is_return() || !scan.beams[after].is_return()) return false;
  const Eigen::Vector2d start = scan.beams[before].point_m;
  const Eigen::Vector2d along = (scan.beams[after].point_m - start).normalized();
  for (std::size_t beam = segment.first; beam <= segment.last; ++beam) {
    const Eigen::Vector2d offset = scan.beams[beam].point_m - start;
    if (std::abs(along.x() * offset.y() - along.y() * offset.x()) > tolerance_m) return false;
  }
  return true;
}

double nearest_object(const Beams& scan, const std::vector<Segment>& segments, std::size_t index,
                      double radius_m) {
  const Segment& own = segments[index];
  double range = scan.beams[own.first].range_m;
  for (std::size_t i = own.first; i <= own.last; ++i)
    range = std::min(range, scan.beams[i].range_m);
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
