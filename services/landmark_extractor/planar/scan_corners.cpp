#include "services/landmark_extractor/planar/scan_corners.hpp"

#include <algorithm>

#include "services/landmark_extractor/corners/corner_pair.hpp"
#include "services/landmark_extractor/planar/segments.hpp"
#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::planar {
namespace {

/// Up to this number of beams without return within a wall are drop-outs.
constexpr double kDropOuts = 3.5;

SweepParameters noise_of(const PlanarTrunkParameters& laser) {
  SweepParameters sweep;
  sweep.range_sigma_m = laser.range_sigma_m;
  return sweep;
}

CornerParameters of_one_ring(CornerParameters corner) {
  corner.min_rings = 1;
  corner.min_extent_m = 0.0;
  return corner;
}

points::RingPoint ring_point(const Beam& beam) {
  points::RingPoint point{};
  point.x_m = static_cast<float>(beam.point_m.x());
  point.y_m = static_cast<float>(beam.point_m.y());
  point.z_m = static_cast<float>(beam.z_m);
  point.azimuth_rad = static_cast<float>(beam.bearing_rad);
  point.range_m = static_cast<float>(beam.range_m);
  point.is_in_range = 1.0F;
  return point;
}

}  // namespace

ScanCorners::ScanCorners(const PlanarTrunkParameters& laser, const CornerParameters& corner)
    : laser_(laser), corner_(of_one_ring(corner)), finder_(noise_of(laser), corner_) {}

/// Runs of neighbouring returns; unlike segments they continue over drop-outs.
void ScanCorners::take_points(const Beams& scan) {
  points_.clear();
  runs_.clear();
  const Beam* previous = nullptr;
  for (const Beam& beam : scan.beams) {
    if (!beam.is_return() || beam.range_m < laser_.min_range_m) continue;
    const auto index = static_cast<std::uint32_t>(points_.size());
    const bool joined = previous != nullptr &&
                        beam.bearing_rad - previous->bearing_rad <= kDropOuts * scan.step_rad &&
                        (beam.point_m - previous->point_m).norm() <=
                            laser_.break_distance_m +
                                laser_.break_per_range * std::min(beam.range_m, previous->range_m);
    if (!joined) {
      runs_.emplace_back();
      runs_.back().first = index;
    }
    runs_.back().last = index;
    points_.push_back(ring_point(beam));
    previous = &beam;
  }

  for (rings::Run& run : runs_) {
    const Eigen::Vector2d right = points_[run.first].position();
    const Eigen::Vector2d left = points_[run.last].position();
    run.width_m = static_cast<float>((left - right).norm());
  }
}

void ScanCorners::find(const Beams& scan, double height_m,
                       const Eigen::Matrix2d& level_covariance_rad2,
                       std::vector<model::Detection>& detections) {
  take_points(scan);
  const std::size_t first = detections.size();
  const Eigen::Vector2d sensor = scan.sensor_m.head<2>();
  const std::vector<corners::WallLine>& walls = finder_.find({points_, 1, sensor}, runs_);
  counters_.walls += walls.size();

  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (std::size_t j = i + 1; j < walls.size(); ++j) {
      auto corner = judge(walls[i], walls[j], sensor);
      if (!corner) continue;
      corner->position_m.z() = height_m;
      corner->covariance_m2 +=
          corners::from_level_error(corner->position_m, walls[i], walls[j], level_covariance_rad2);
      corner->covariance_m2(2, 2) += square(kHeightSigma_m);
      corners::add_once(*corner, corner_, first, detections);
    }
  }
  counters_.corners += detections.size() - first;
}

/// The corner of two walls; else none, and the reason is counted.
std::optional<model::Detection> ScanCorners::judge(const corners::WallLine& a,
                                                   const corners::WallLine& b,
                                                   const Eigen::Vector2d& sensor) {
  const auto meeting = corners::meet(a, b, sensor, corner_);
  if (!meeting || (meeting->place_m - sensor).norm() > laser_.max_range_m) return std::nullopt;
  ++counters_.pairs;
  if (corners::skew_rad(*meeting) > corner_.max_skew_rad) {
    ++counters_.skew;
    return std::nullopt;
  }
  const auto side = corners::side_of(*meeting, sensor);
  if (!side) {
    ++counters_.hidden;
    return std::nullopt;
  }
  return corners::corner_at(*meeting, a, b, *side);
}

}  // namespace understory::landmark_extractor::planar
