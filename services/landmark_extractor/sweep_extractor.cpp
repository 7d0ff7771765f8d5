#include "services/landmark_extractor/sweep_extractor.hpp"

#include <algorithm>
#include <cmath>

namespace understory::landmark_extractor {
namespace {

/// More beams than any sensor has.
constexpr std::uint16_t kMaxRings = 1024;
/// Margin beyond the range of landmarks, to see what is behind them [m].
constexpr double kMargin_m = 2.0;

/// Least length of a wall that removes trunks, and their distance from its plane and its ends [m].
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

/// Covariance of (roll, pitch) [rad^2]: the sweep's own, or the default without an attitude.
Eigen::Matrix2d level_covariance_of(const model::PointSweep& sweep,
                                    const SweepParameters& parameters) {
  if (sweep.attitude) return sweep.attitude->covariance_rad2;
  return parameters.level_sigma_rad * parameters.level_sigma_rad * Eigen::Matrix2d::Identity();
}

/// The part of a wall between two windows or two cars resembles a trunk.
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
  view_ = {};
  if (!well_formed(sweep)) {
    ++counters_.malformed;
    return result;
  }
  if (!sweep.attitude) ++counters_.without_attitude;
  result.field_of_view.max_range_m = sweep_.max_range_m;
  const Eigen::Matrix2d level_covariance = level_covariance_of(sweep, sweep_);

  // Ground below the vehicle's surroundings.
  const double range_m = sweep_.max_range_m + kMargin_m;
  const points::Levelling& levelling = cloud_.look_at(sweep, sweep_.min_range_m, range_m);
  sample_.take(sweep, levelling);
  ground_.fit(sample_);

  // Objects above it, ring by ring.
  cloud_.fill(sweep, ground_, counters_.points);
  profile_.begin(levelling, ground_, sweep_);
  find_runs_of_all_rings();
  view_ = profile_.finish(sweep, cloud_, levelling, ground_);

  // Landmarks.
  trunks_.find(cloud_, runs_, ground_, level_covariance, result.detections);
  corners_.find(cloud_, runs_, ground_, level_covariance, result.detections);
  leave_out_walls(result.detections);

  counters_.trunks = trunks_.counters();
  counters_.corners = corners_.counters();
  sort_by_bearing(result.detections);
  return result;
}

void SweepExtractor::find_runs_of_all_rings() {
  runs_.clear();
  const auto lowest = static_cast<float>(sweep_.min_height_m);
  for (std::size_t ring = 0; ring < cloud_.rings(); ++ring) {
    cloud_.order(ring, lowest);
    find_runs(cloud_, sweep_, ring, runs_);
    profile_.take_ring(cloud_, ring);
  }
}

void SweepExtractor::leave_out_walls(std::vector<model::Detection>& detections) {
  counters_.on_wall += std::erase_if(detections, [&](const model::Detection& detection) {
    return detection.kind == model::LandmarkKind::kTrunk &&
           std::any_of(corners_.walls().begin(), corners_.walls().end(),
                       [&](const corners::WallLine& wall) { return is_on(wall, detection); });
  });
}

}  // namespace understory::landmark_extractor
