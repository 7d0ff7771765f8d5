#include "services/landmark_extractor/corners/sweep_corners.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::corners {
namespace {

/// The height of a wall is checked this far from its corner [m].
constexpr double kAside_m = 0.4;
/// Rings this much above its highest return should have met it, were it higher [m].
constexpr double kAbove_m = 0.02;
/// So many beams on either side do not all drop out.
constexpr float kBeamsAside = 2.5F;

/// An error of roll and pitch moves each wall by its own height, and the corner with them; its
/// height goes with the ground.
Eigen::Matrix3d from_level_error(const Eigen::Vector3d& place, const WallLine& a, const WallLine& b,
                                 const Eigen::Matrix2d& level_covariance_rad2) {
  Eigen::Matrix2d normals;
  normals << a.normal().transpose(), b.normal().transpose();
  // In the plan (roll, pitch) moves what is at height z by z (pitch, -roll).
  const auto across = [](const WallLine& wall) {
    return Eigen::RowVector2d(wall.z_m * -wall.normal().y(), wall.z_m * wall.normal().x());
  };
  Eigen::Matrix2d offsets;
  offsets << across(a), across(b);
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << normals.inverse() * offsets, place.y(), -place.x();
  return jacobian * level_covariance_rad2 * jacobian.transpose();
}

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

/// Away from `place` into the wall.
Eigen::Vector2d along(const WallLine& wall, const Eigen::Vector2d& place) {
  const double at = wall.direction.dot(place - wall.centroid_m);
  return at < 0.5 * (wall.from_m + wall.to_m) ? wall.direction : Eigen::Vector2d(-wall.direction);
}

}  // namespace

void SweepCorners::find(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                        const ground::GroundSurface& ground,
                        const Eigen::Matrix2d& level_covariance_rad2,
                        std::vector<model::Detection>& detections) {
  const std::size_t first = detections.size();
  found_ = walls_.find(cloud, runs);
  counters_.walls += found_.size();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    for (std::size_t j = i + 1; j < found_.size(); ++j) {
      if (const auto corner = judge(cloud, found_[i], found_[j], ground, level_covariance_rad2)) {
        add(*corner, first, detections);
      }
    }
  }
  counters_.corners += detections.size() - first;
}

/// Windows and doors make several walls of one: the edge of a house is given once, by the pair with
/// the smallest covariance.
void SweepCorners::add(const model::Detection& corner, std::size_t first,
                       std::vector<model::Detection>& detections) const {
  const auto is_same = [&](const model::Detection& other) {
    const double turned =
        std::remainder(corner.bearing_rad - other.bearing_rad, 2.0 * std::numbers::pi);
    return (corner.position_m - other.position_m).head<2>().norm() < corner_.max_gap_m &&
           std::abs(turned) < corner_.max_skew_rad;
  };

  const auto same = std::find_if(detections.begin() + static_cast<std::ptrdiff_t>(first),
                                 detections.end(), is_same);
  if (same == detections.end()) {
    detections.push_back(corner);
  } else if (corner.covariance_m2.topLeftCorner<2, 2>().trace() <
             same->covariance_m2.topLeftCorner<2, 2>().trace()) {
    *same = corner;
  }
}

std::optional<SweepCorners::Meeting> SweepCorners::meet(const WallLine& a, const WallLine& b,
                                                        const Eigen::Vector2d& sensor) const {
  const double sine = cross(a.direction, b.direction);
  if (std::abs(sine) < 0.3) return std::nullopt;
  Meeting meeting;
  const Eigen::Vector2d between = b.centroid_m - a.centroid_m;
  meeting.reach_a_m = cross(between, b.direction) / sine;
  meeting.reach_b_m = cross(between, a.direction) / sine;
  meeting.place_m = a.centroid_m + meeting.reach_a_m * a.direction;

  // At the ends of both, and at the same heights?
  const double gap =
      corner_.max_gap_m + corner_.max_gap_per_range * (meeting.place_m - sensor).norm();
  const auto at_end = [&](const WallLine& wall, double reach) {
    return std::abs(reach - wall.from_m) < gap || std::abs(reach - wall.to_m) < gap;
  };
  if (!at_end(a, meeting.reach_a_m) || !at_end(b, meeting.reach_b_m)) return std::nullopt;
  const double overlap = std::min(a.high_z_m, b.high_z_m) - std::max(a.low_z_m, b.low_z_m);
  if (overlap < 0.5 * corner_.min_extent_m) return std::nullopt;

  meeting.along_a = along(a, meeting.place_m);
  meeting.along_b = along(b, meeting.place_m);
  return meeting;
}

std::optional<model::Detection> SweepCorners::judge(const rings::RingCloud& cloud,
                                                    const WallLine& a, const WallLine& b,
                                                    const ground::GroundSurface& ground,
                                                    const Eigen::Matrix2d& level_covariance_rad2) {
  const Eigen::Vector2d sensor = cloud.sensor_m().head<2>().cast<double>();
  const auto meeting = meet(a, b, sensor);
  if (!meeting || (meeting->place_m - sensor).norm() > sweep_.max_range_m) return std::nullopt;

  // At a right angle?
  ++counters_.pairs;
  if (std::abs(std::asin(std::clamp(meeting->along_a.dot(meeting->along_b), -1.0, 1.0))) >
      corner_.max_skew_rad) {
    ++counters_.skew;
    return std::nullopt;
  }

  // Both faces are measured from in front of the corner or from within it.
  const Eigen::Vector2d to_sensor = sensor - meeting->place_m;
  const bool inside_a = meeting->along_a.dot(to_sensor) > 0.0;
  const bool inside_b = meeting->along_b.dot(to_sensor) > 0.0;
  if (inside_a != inside_b) {
    ++counters_.hidden;
    return std::nullopt;
  }

  // A house is taller than a person.
  const ground::GroundHeight below = ground.below(meeting->place_m);
  if (!is_tall(cloud, a, meeting->place_m, meeting->along_a, below.height_m) ||
      !is_tall(cloud, b, meeting->place_m, meeting->along_b, below.height_m)) {
    ++counters_.low;
    return std::nullopt;
  }

  // Position, covariance, bearing.
  model::Detection corner;
  corner.kind = model::LandmarkKind::kCorner;
  corner.position_m << meeting->place_m, below.height_m + sweep_.breast_height_m;

  // Each wall fixes the place across itself; unevenness counts at the corner, not at the centroid.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  const auto add = [&](const WallLine& wall, double reach) {
    const double variance = square(wall.offset_sigma_m) + square(reach * wall.direction_sigma_rad);
    information += wall.normal() * wall.normal().transpose() / variance;
  };
  add(a, meeting->reach_a_m);
  add(b, meeting->reach_b_m);
  corner.covariance_m2 = from_level_error(corner.position_m, a, b, level_covariance_rad2);
  corner.covariance_m2.topLeftCorner<2, 2>() += information.inverse();
  corner.covariance_m2(2, 2) += square(below.sigma_m);

  const Eigen::Vector2d inward = meeting->along_a + meeting->along_b;
  const Eigen::Vector2d open = inside_a ? inward : Eigen::Vector2d(-inward);
  corner.bearing_rad = std::atan2(open.y(), open.x());
  corner.bearing_sigma_rad = 0.5 * std::hypot(a.direction_sigma_rad, b.direction_sigma_rad);
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
