#include "services/landmark_extractor/sweep_extractor.hpp"

#include <algorithm>
#include <cmath>

namespace understory::landmark_extractor {
namespace {

/// More beams than any sensor has.
constexpr std::uint16_t kMaxRings = 1024;
/// What stands behind a landmark is looked at this far beyond the range of landmarks [m].
constexpr double kMargin_m = 2.0;

/// Walls at least this long swallow trunks so near their plane and so near their ends [m].
constexpr double kWall_m = 1.5;
constexpr double kOnWall_m = 0.25;
constexpr double kWallEnd_m = 0.5;

bool well_formed(const model::PointSweep& sweep) {
  const bool has_frame = sweep.is_deskewed && sweep.sensor_position_m.allFinite() &&
                         sweep.rings > 0 && sweep.rings <= kMaxRings;
  if (!has_frame || !sweep.attitude) return has_frame;
  const double norm = sweep.attitude->level_Q_vehicle.norm();
  return std::abs(norm - 1.0) < 1e-3 && sweep.attitude->covariance_rad2.allFinite();
}

/// A piece of a wall between two windows or two cars looks like a trunk.
bool is_on(const corners::WallLine& wall, const model::Detection& trunk) {
  const Eigen::Vector2d offset = trunk.position_m.head<2>() - wall.centroid_m;
  const double along = wall.direction.dot(offset);
  return wall.length() > kWall_m && std::abs(wall.normal().dot(offset)) < kOnWall_m &&
         along > wall.from_m - kWallEnd_m && along < wall.to_m + kWallEnd_m;
}

void sort_by_bearing(std::vector<model::Detection>& detections) {
  const auto bearing = [](const model::Detection& detection) {
    return std::atan2(detection.position_m.y(), detection.position_m.x());
  };
  std::stable_sort(detections.begin(), detections.end(),
                   [&](const model::Detection& a, const model::Detection& b) {
                     return a.kind != b.kind ? a.kind < b.kind : bearing(a) < bearing(b);
                   });
}

}  // namespace

model::LandmarkScan SweepExtractor::extract(const model::PointSweep& sweep) {
  model::LandmarkScan result;
  result.utime = sweep.utime;
  result.sequence = sweep.sequence;
  ++counters_.sweeps;
  if (!well_formed(sweep)) {
    ++counters_.malformed;
    return result;
  }
  result.field_of_view.max_range_m = sweep_.max_range_m;
  Eigen::Matrix2d level_covariance =
      sweep_.level_sigma_rad * sweep_.level_sigma_rad * Eigen::Matrix2d::Identity();
  if (sweep.attitude) level_covariance = sweep.attitude->covariance_rad2;
  if (!sweep.attitude) ++counters_.without_attitude;
  const double reach = sweep_.max_range_m + kMargin_m;
  const auto lowest = static_cast<float>(sweep_.min_height_m);
  sample_.take(sweep, cloud_.look_at(sweep, sweep_.min_range_m, reach));
  ground_.fit(sample_);
  cloud_.fill(sweep, ground_, counters_.points);
  runs_.clear();
  for (std::size_t ring = 0; ring < cloud_.rings(); ++ring) {
    cloud_.order(ring, lowest);
    find_runs(cloud_, sweep_, ring, runs_);
  }
  trunks_.find(cloud_, runs_, ground_, level_covariance, result.detections);
  const std::size_t trunks = result.detections.size();
  corners_.find(cloud_, runs_, ground_, level_covariance, result.detections);
  std::erase_if(result.detections, [&](const model::Detection& detection) {
    return detection.kind == model::LandmarkKind::kTrunk &&
           std::any_of(corners_.walls().begin(), corners_.walls().end(),
                       [&](const corners::WallLine& wall) { return is_on(wall, detection); });
  });
  const auto left = static_cast<std::size_t>(std::count_if(
      result.detections.begin(), result.detections.end(),
      [](const model::Detection& d) { return d.kind == model::LandmarkKind::kTrunk; }));
  counters_.on_wall += trunks - left;
  counters_.trunks = trunks_.counters();
  counters_.corners = corners_.counters();
  sort_by_bearing(result.detections);
  return result;
}

}  // namespace understory::landmark_extractor
