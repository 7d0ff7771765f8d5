#include "services/landmark_extractor/corners/wall_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/geometry/decompositions.hpp"
#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::corners {
namespace {

/// Directions of segments of one wall differ by less than this [rad]...
constexpr double kSameDirection = 0.1;
/// ... and they are at most this many rings apart: windows and shutters interrupt a wall.
constexpr std::size_t kRingReach = 4;

/// Number of stretches over which a wall's unevenness is measured.
constexpr std::size_t kStretches = 8;
/// Least scatter of points across a wall, relative to their range noise.
constexpr double kLeastAcross = 0.1;
/// Weight of the stated noise with a single ring, in points.
constexpr double kStatedPoints = 6.0;
/// Number of neighbours on a segment that are summed.
constexpr std::size_t kPartPoints = 8;

}  // namespace

void LineSums::add(const Eigen::Vector2d& point) {
  count += 1.0;
  sum += point;
  square += point * point.transpose();
}

LineSums& LineSums::operator+=(const LineSums& other) {
  count += other.count;
  sum += other.sum;
  square += other.square;
  return *this;
}

const std::vector<WallLine>& WallFinder::find(const WallPoints& all,
                                              const std::vector<rings::Run>& runs) {
  segments_.clear();
  parts_.clear();
  walls_.clear();
  sensor_m_ = all.sensor_m;
  is_one_ring_ = all.rings == 1;
  ring_begins_.assign(all.rings + 1, 0);

  for (const rings::Run& run : runs) {
    if (run.size() >= rings::kLeastOfWall && run.width_m > 0.5 * corner_.min_length_m) {
      split(all, run, run.first, run.last);
    }
    ring_begins_[run.ring + std::size_t{1}] = segments_.size();
  }
  // Skips rings without a segment.
  for (std::size_t ring = 0; ring < all.rings; ++ring) {
    ring_begins_[ring + 1] = std::max(ring_begins_[ring], ring_begins_[ring + 1]);
  }
  join();
  return walls_;
}

/// Douglas and Peucker: cuts at the point farthest from the chord.
void WallFinder::split(const WallPoints& all, const rings::Run& run, std::size_t first,
                       std::size_t last) {
  if (last - first + 1 < rings::kLeastOfWall) return;
  const Eigen::Vector2f from(all.points[first].x_m, all.points[first].y_m);
  const Eigen::Vector2f to(all.points[last].x_m, all.points[last].y_m);
  const Eigen::Vector2f along = (to - from).normalized();
  const auto tolerance = static_cast<float>(corner_.line_tolerance_m);

  float farthest = 0.0F;
  std::size_t cut = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const points::RingPoint& point = all.points[i];
    const float off =
        std::abs(along.x() * (point.y_m - from.y()) - along.y() * (point.x_m - from.x()));
    if (off > farthest) {
      farthest = off;
      cut = i;
    }
  }

  if (farthest > tolerance) {
    split(all, run, first, cut);
    split(all, run, cut, last);
  } else {
    add_segment(all, run, first, last);
  }
}

void WallFinder::add_segment(const WallPoints& all, const rings::Run& run, std::size_t first,
                             std::size_t last) {
  LineSegment segment;
  segment.from_m = all.points[first].position();
  segment.to_m = all.points[last].position();
  segment.length_m = (segment.to_m - segment.from_m).norm();
  if (segment.length_m < 0.5 * corner_.min_length_m) return;
  segment.direction = (segment.to_m - segment.from_m) / segment.length_m;
  // A segment along the beams is a row of edges, not a wall.
  const Eigen::Vector2d beam = segment.from_m - all.sensor_m;
  if (std::abs(cross(beam.normalized(), segment.direction)) < 0.05) return;

  // Sums of its inner points.
  double z = 0.0;
  // The end points, where segments meet, are ambiguous.
  segment.first_part = static_cast<std::uint32_t>(parts_.size());
  for (std::size_t i = first + 1; i < last; ++i) {
    if ((i - first - 1) % kPartPoints == 0) parts_.emplace_back();
    parts_.back().count += 1.0;
    parts_.back().sum += all.points[i].position();
    segment.sums.add(all.points[i].position());
    z += all.points[i].z_m;
  }

  segment.parts = static_cast<std::uint32_t>(parts_.size()) - segment.first_part;
  segment.ring = run.ring;
  segment.z_m = z / segment.sums.count;
  segment.first = static_cast<std::uint32_t>(first);
  segment.last = static_cast<std::uint32_t>(last);
  segments_.push_back(segment);
}

bool WallFinder::same_wall(const LineSegment& a, const LineSegment& b) const {
  const Eigen::Vector2d& direction = a.direction;
  if (std::abs(cross(direction, b.direction)) > kSameDirection ||
      direction.dot(b.direction) < 0.0) {
    return false;
  }

  const Eigen::Vector2d middle = 0.5 * (b.from_m + b.to_m) - a.from_m;
  const double length = a.length_m;
  const double half = 0.5 * b.length_m;
  const double along = direction.dot(middle);
  const double lever = std::max(length, 2.0 * half);
  const double across = std::abs(cross(direction, middle));
  // Segments of one ring lie beside each other, separated by noise or by an object in front of the
  // wall.
  const double gap = is_one_ring_ ? corner_.max_gap_m : 0.0;
  // The directions of two short segments are uncertain, but not their proximity.
  return across < corner_.line_tolerance_m * (1.0 + std::abs(along - 0.5 * length) / lever) &&
         along + half > -gap && along - half < length + gap;
}

std::uint32_t WallFinder::root(std::uint32_t segment) {
  while (parents_[segment] != segment) {
    parents_[segment] = parents_[parents_[segment]];
    segment = parents_[segment];
  }
  return segment;
}

void WallFinder::join() {
  parents_.resize(segments_.size());
  std::iota(parents_.begin(), parents_.end(), 0U);
  for (std::uint32_t i = 0; i < segments_.size(); ++i) {
    const std::size_t last_ring =
        std::min<std::size_t>(ring_begins_.size() - 2, segments_[i].ring + kRingReach);
    const std::size_t end = ring_begins_[last_ring + 1];
    const std::size_t next_ring = ring_begins_[segments_[i].ring + std::size_t{1}];
    for (auto j = is_one_ring_ ? i + 1 : static_cast<std::uint32_t>(next_ring); j < end; ++j) {
      if (same_wall(segments_[i], segments_[j])) parents_[root(j)] = root(i);
    }
  }

  members_.resize(std::max(members_.size(), segments_.size()));
  for (std::uint32_t i = 0; i < segments_.size(); ++i) members_[root(i)].push_back(i);
  for (std::uint32_t i = 0; i < segments_.size(); ++i) {
    if (!members_[i].empty()) add_wall(members_[i]);
    members_[i].clear();
  }
}

/// RMS distance of stretches of the wall from its line beyond their points' noise: neighbouring
/// rings measure the same bumps.
double WallFinder::unevenness(const std::vector<std::uint32_t>& members, const WallLine& wall,
                              double variance_m2) const {
  std::array<double, kStretches> counts{};
  std::array<double, kStretches> offsets{};
  const Eigen::Vector2d normal = wall.normal();
  for (const std::uint32_t i : members) {
    for (std::uint32_t k = 0; k < segments_[i].parts; ++k) {
      const SegmentPart& part = parts_[segments_[i].first_part + k];
      const Eigen::Vector2d offset = part.sum / part.count - wall.centroid_m;
      const double along = (wall.direction.dot(offset) - wall.from_m) / wall.length();
      const auto stretch = static_cast<std::size_t>(
          std::clamp(along * kStretches, 0.0, static_cast<double>(kStretches) - 1.0));
      counts[stretch] += part.count;
      offsets[stretch] += part.count * normal.dot(offset);
    }
  }

  double excess = 0.0;
  double stretches = 0.0;
  for (std::size_t k = 0; k < kStretches; ++k) {
    if (counts[k] < static_cast<double>(kPartPoints)) continue;
    excess += square(offsets[k] / counts[k]) - variance_m2 / counts[k];
    stretches += 1.0;
  }
  // The line uses two degrees of freedom.
  return stretches > 3.0 ? std::sqrt(std::max(0.0, excess / (stretches - 2.0))) : 0.0;
}

/// The few points of one ring may lie on their line by chance: the stated noise of a beam is
/// combined with their scatter.
double WallFinder::variance_across(const LineSums& sums, const WallLine& wall,
                                   double axis2_m2) const {
  if (wall.rings > 1) return std::max(axis2_m2, square(kLeastAcross * sweep_.range_sigma_m));
  const Eigen::Vector2d beam = (wall.centroid_m - sensor_m_).normalized();
  const double stated = std::max(std::abs(wall.normal().dot(beam)), kLeastAcross);
  return (sums.count * axis2_m2 + kStatedPoints * square(stated * sweep_.range_sigma_m)) /
         (sums.count - 2.0 + kStatedPoints);
}

void WallFinder::add_wall(const std::vector<std::uint32_t>& members) {
  LineSums sums;
  WallLine wall;
  wall.low_z_m = std::numeric_limits<double>::infinity();
  wall.high_z_m = -wall.low_z_m;
  std::uint16_t ring = 0xffff;
  for (const std::uint32_t i : members) {
    const LineSegment& segment = segments_[i];
    sums += segment.sums;
    wall.z_m += segment.sums.count * segment.z_m;
    wall.low_z_m = std::min(wall.low_z_m, segment.z_m);
    wall.high_z_m = std::max(wall.high_z_m, segment.z_m);
    if (segment.ring != ring) ++wall.rings;
    ring = segment.ring;
  }
  if (wall.rings < corner_.min_rings || wall.high_z_m - wall.low_z_m < corner_.min_extent_m) return;

  // Total least squares.
  wall.centroid_m = sums.sum / sums.count;
  wall.z_m /= sums.count;
  const Eigen::Matrix2d scatter =
      sums.square / sums.count - wall.centroid_m * wall.centroid_m.transpose();
  const geometry::PrincipalAxes axes = geometry::principal_axes(scatter);
  wall.direction = axes.vectors.col(1);
  if (wall.direction.dot(segments_[members[0]].direction) < 0.0) wall.direction *= -1.0;
  const double across2 = variance_across(sums, wall, axes.values[0]);
  if (std::sqrt(across2) > corner_.line_tolerance_m) return;

  // Its extent.
  wall.from_m = std::numeric_limits<double>::infinity();
  wall.to_m = -wall.from_m;
  for (const std::uint32_t i : members) {
    wall.from_m = std::min(wall.from_m, wall.direction.dot(segments_[i].from_m - wall.centroid_m));
    wall.to_m = std::max(wall.to_m, wall.direction.dot(segments_[i].to_m - wall.centroid_m));
  }
  if (wall.length() < corner_.min_length_m) return;

  // Noise averages out over points, unevenness over stretches of the wall.
  wall.unevenness_m = std::hypot(unevenness(members, wall, across2), corner_.flatness_sigma_m);
  const double of_offset = across2 / sums.count + square(wall.unevenness_m) / kStretches;
  wall.offset_sigma_m = std::sqrt(of_offset);
  const double length2 = axes.values[1];
  wall.direction_sigma_rad = std::sqrt(of_offset / length2);
  walls_.push_back(wall);
}

}  // namespace understory::landmark_extractor::corners
