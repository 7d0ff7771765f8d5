#include "services/landmark_extractor/corners/corner_pair.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::corners {
namespace {

/// Direction from `place` into the wall.
Eigen::Vector2d along(const WallLine& wall, const Eigen::Vector2d& place) {
  const double at = wall.direction.dot(place - wall.centroid_m);
  return at < 0.5 * (wall.from_m + wall.to_m) ? wall.direction : Eigen::Vector2d(-wall.direction);
}

/// Walls from a one-plane laser have one height.
bool at_same_heights(const WallLine& a, const WallLine& b, const CornerParameters& parameters) {
  if (a.rings == 1 && b.rings == 1) return true;
  const double overlap = std::min(a.high_z_m, b.high_z_m) - std::max(a.low_z_m, b.low_z_m);
  return overlap >= 0.5 * parameters.min_extent_m;
}

}  // namespace

std::optional<Meeting> meet(const WallLine& a, const WallLine& b, const Eigen::Vector2d& sensor,
                            const CornerParameters& parameters) {
  const double sine = cross(a.direction, b.direction);
  if (std::abs(sine) < 0.3) return std::nullopt;
  Meeting meeting;
  const Eigen::Vector2d between = b.centroid_m - a.centroid_m;
  meeting.reach_a_m = cross(between, b.direction) / sine;
  meeting.reach_b_m = cross(between, a.direction) / sine;
  meeting.place_m = a.centroid_m + meeting.reach_a_m * a.direction;

  // Is the intersection at the ends of both walls?
  const double gap =
      parameters.max_gap_m + parameters.max_gap_per_range * (meeting.place_m - sensor).norm();
  const auto at_end = [&](const WallLine& wall, double reach) {
    return std::abs(reach - wall.from_m) < gap || std::abs(reach - wall.to_m) < gap;
  };
  if (!at_end(a, meeting.reach_a_m) || !at_end(b, meeting.reach_b_m)) return std::nullopt;
  if (!at_same_heights(a, b, parameters)) return std::nullopt;

  meeting.along_a = along(a, meeting.place_m);
  meeting.along_b = along(b, meeting.place_m);
  return meeting;
}

double skew_rad(const Meeting& meeting) {
  return std::abs(std::asin(std::clamp(meeting.along_a.dot(meeting.along_b), -1.0, 1.0)));
}

/// Both faces are visible only from in front of the corner or from inside it.
std::optional<Side> side_of(const Meeting& meeting, const Eigen::Vector2d& sensor) {
  const Eigen::Vector2d to_sensor = sensor - meeting.place_m;
  const bool inside_a = meeting.along_a.dot(to_sensor) > 0.0;
  const bool inside_b = meeting.along_b.dot(to_sensor) > 0.0;
  if (inside_a != inside_b) return std::nullopt;
  return inside_a ? Side::kWithin : Side::kFront;
}

model::Detection corner_at(const Meeting& meeting, const WallLine& a, const WallLine& b,
                           Side side) {
  model::Detection corner;
  corner.kind = model::LandmarkKind::kCorner;
  corner.position_m.head<2>() = meeting.place_m;

  // Each wall determines the position across itself; unevenness acts at the corner, not at the
  // centroid.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  const auto add = [&](const WallLine& wall, double reach) {
    const double variance = square(wall.offset_sigma_m) + square(reach * wall.direction_sigma_rad);
    information += wall.normal() * wall.normal().transpose() / variance;
  };
  add(a, meeting.reach_a_m);
  add(b, meeting.reach_b_m);
  corner.covariance_m2.topLeftCorner<2, 2>() = information.inverse();

  const Eigen::Vector2d inward = meeting.along_a + meeting.along_b;
  const Eigen::Vector2d open = side == Side::kWithin ? inward : Eigen::Vector2d(-inward);
  corner.bearing_rad = std::atan2(open.y(), open.x());
  corner.bearing_sigma_rad = 0.5 * std::hypot(a.direction_sigma_rad, b.direction_sigma_rad);
  return corner;
}

/// A roll and pitch error displaces each wall in proportion to its own height, and the corner with
/// them; the corner's height follows the ground.
Eigen::Matrix3d from_level_error(const Eigen::Vector3d& position_m, const WallLine& a,
                                 const WallLine& b, const Eigen::Matrix2d& level_covariance_rad2) {
  Eigen::Matrix2d normals;
  normals << a.normal().transpose(), b.normal().transpose();
  // In the plan (roll, pitch) displaces a point at height z by z (pitch, -roll).
  const auto across = [](const WallLine& wall) {
    return Eigen::RowVector2d(wall.z_m * -wall.normal().y(), wall.z_m * wall.normal().x());
  };
  Eigen::Matrix2d offsets;
  offsets << across(a), across(b);
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << normals.inverse() * offsets, position_m.y(), -position_m.x();
  return jacobian * level_covariance_rad2 * jacobian.transpose();
}

void add_once(const model::Detection& corner, const CornerParameters& parameters, std::size_t first,
              std::vector<model::Detection>& detections) {
  const auto is_same = [&](const model::Detection& other) {
    const double turned =
        std::remainder(corner.bearing_rad - other.bearing_rad, 2.0 * std::numbers::pi);
    return (corner.position_m - other.position_m).head<2>().norm() < parameters.max_gap_m &&
           std::abs(turned) < parameters.max_skew_rad;
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

}  // namespace understory::landmark_extractor::corners
