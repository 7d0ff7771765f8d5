#include "services/landmark_extractor/corners/sweep_corners.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::corners {
namespace {

/// The height of a wall is checked this far from its corner [m].
constexpr double kAside_m = 0.4;
/// A ring this much above a wall's highest return should have hit a higher wall [m].
constexpr double kAbove_m = 0.02;
/// This number of beams on either side cannot all be drop-outs.
constexpr float kBeamsAside = 2.5F;

/// Whether the ring's beams about an azimuth go beyond the range, or have no return.
bool passes(const rings::RingCloud& cloud, std::size_t ring, float azimuth, double range) {
  const float half = kBeamsAside * cloud.step_rad(ring);
  const std::size_t end = cloud.ring_end(ring);
  for (std::size_t i = cloud.first_at(ring, azimuth - half); i < end; ++i) {
    const points::RingPoint& point = cloud.points()[i];
    const float off = std::remainder(point.azimuth_rad - azimuth, 2.0F * std::numbers::pi_v<float>);
    if (std::abs(off) > half) break;
    if (point.range_m <= range) return false;
  }
  return true;
}

}  // namespace

void SweepCorners::find(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                        const ground::GroundSurface& ground,
                        const Eigen::Matrix2d& level_covariance_rad2,
                        std::vector<model::Detection>& detections) {
  const std::size_t first = detections.size();
  const WallPoints points{cloud.points(), cloud.rings(), cloud.sensor_m().head<2>().cast<double>()};
  found_ = walls_.find(points, runs);
  counters_.walls += found_.size();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    for (std::size_t j = i + 1; j < found_.size(); ++j) {
      if (const auto corner = judge(cloud, found_[i], found_[j], ground, level_covariance_rad2)) {
        add_once(*corner, corner_, first, detections);
      }
    }
  }
  counters_.corners += detections.size() - first;
}

std::optional<model::Detection> SweepCorners::judge(const rings::RingCloud& cloud,
                                                    const WallLine& a, const WallLine& b,
                                                    const ground::GroundSurface& ground,
                                                    const Eigen::Matrix2d& level_covariance_rad2) {
  const Eigen::Vector2d sensor = cloud.sensor_m().head<2>().cast<double>();
  const auto meeting = meet(a, b, sensor, corner_);
  if (!meeting || (meeting->place_m - sensor).norm() > sweep_.max_range_m) return std::nullopt;

  // Is it a right angle?
  ++counters_.pairs;
  if (skew_rad(*meeting) > corner_.max_skew_rad) {
    ++counters_.skew;
    return std::nullopt;
  }

  const auto side = side_of(*meeting, sensor);
  if (!side) {
    ++counters_.hidden;
    return std::nullopt;
  }

  // Is it taller than a person?
  const ground::GroundHeight below = ground.below(meeting->place_m);
  if (!is_tall(cloud, a, meeting->place_m, meeting->along_a, below.height_m) ||
      !is_tall(cloud, b, meeting->place_m, meeting->along_b, below.height_m)) {
    ++counters_.low;
    return std::nullopt;
  }

  model::Detection corner = corner_at(*meeting, a, b, *side);
  corner.position_m.z() = below.height_m + sweep_.breast_height_m;
  corner.covariance_m2 += from_level_error(corner.position_m, a, b, level_covariance_rad2);
  corner.covariance_m2(2, 2) += square(below.sigma_m);
  return corner;
}

/// Whether no beam passes over the wall, near its corner, below a person's height.
bool SweepCorners::is_tall(const rings::RingCloud& cloud, const WallLine& wall,
                           const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
                           double ground_z) const {
  const Eigen::Vector2d sensor = cloud.sensor_m().head<2>().cast<double>();
  const double aside = std::min(kAside_m, 0.5 * wall.length());
  const Eigen::Vector2d place = corner + aside * along;
  const double distance = (place - sensor).norm();
  const auto azimuth =
      static_cast<float>(std::atan2(place.y() - sensor.y(), place.x() - sensor.x()));

  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    if (cloud.step_rad(ring) <= 0.0F) continue;
    const double z = cloud.sensor_m().z() + cloud.slope(ring, azimuth) * distance;
    const bool is_above = z > wall.high_z_m + kAbove_m && z < ground_z + sweep_.standing_height_m;
    if (is_above && passes(cloud, ring, azimuth, distance + sweep_.clearance_m)) return false;
  }
  return true;
}

}  // namespace understory::landmark_extractor::corners
