#include "services/lidar_imu_input/laser_check.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::lidar_imu_input {
namespace {

constexpr double kLaserDegree_rad = std::numbers::pi / 180.0;

/// Points within these distances from the sensor can be ground.
constexpr float kNearest_m = 1.0F;
constexpr float kFarthest_m = 20.0F;
constexpr std::size_t kMostPoints = 400;
constexpr int kTrials = 60;
/// Points of a sweep whose azimuths are compared: about a degree apart.
constexpr std::size_t kMostTurns = 400;
/// Largest distance of a point from its plane: grass, bumps.
constexpr double kOnPlane_m = 0.12;
constexpr double kShareOnPlane = 0.33;
/// Steeper planes are walls.
constexpr double kNoWall = 0.64;

/// Number of planes over which older ones are forgotten.
constexpr double kRemembered = 20.0;
constexpr double kMostlyAbove = 0.8;
/// A ceiling has another distance than the expected ground.
constexpr double kHeightTolerance_m = 0.3;
constexpr double kHeightTolerance_share = 0.1;
/// Planes this far apart are of different ground.
constexpr double kApart_m = 2.0;
constexpr double kFewest = 8.0;
constexpr double kSigmas = 5.0;
constexpr double kMostTilt_rad = 3.0 * kLaserDegree_rad;
constexpr double kMostHeightError_m = 0.15;
/// Limits the mean to about the last 100 m.
constexpr double kMostCount = 50.0;

std::optional<GroundPlane> plane_through(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c,
                                         const Eigen::Vector3d& sensor_m) {
  Eigen::Vector3d normal = (b - a).cross(c - a);
  if (normal.norm() < 1e-3) return std::nullopt;
  normal.normalize();
  if (normal.dot(sensor_m - a) < 0.0) normal = -normal;
  return GroundPlane{normal, normal.dot(sensor_m - a)};
}

bool is_on(const GroundPlane& plane, const Eigen::Vector3d& point_m,
           const Eigen::Vector3d& sensor_m) {
  return std::abs(plane.normal.dot(sensor_m - point_m) - plane.distance_m) < kOnPlane_m;
}

/// Least squares through the points of the plane.
GroundPlane refined(const GroundPlane& plane, std::span<const Eigen::Vector3d> points_m,
                    const Eigen::Vector3d& sensor_m) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (const Eigen::Vector3d& point : points_m) {
    if (!is_on(plane, point, sensor_m)) continue;
    sum += point;
    squares += point * point.transpose();
    count += 1.0;
  }
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / count -
                                                              mean * mean.transpose());
  Eigen::Vector3d normal = solver.eigenvectors().col(0);
  if (normal.dot(sensor_m - mean) < 0.0) normal = -normal;
  return {normal, normal.dot(sensor_m - mean)};
}

/// Points that may be ground, evenly over the revolution.
std::vector<Eigen::Vector3d> sample_of(const model::PointSweep& sweep) {
  std::vector<Eigen::Vector3d> near_m;
  const Eigen::Vector3f sensor_m = sweep.sensor_position_m.cast<float>();
  for (const model::SweepPoint& point : sweep.points) {
    const float distance_m = (point.position() - sensor_m).norm();
    if (distance_m > kNearest_m && distance_m < kFarthest_m)
      near_m.emplace_back(point.position().cast<double>());
  }
  if (near_m.size() <= kMostPoints) return near_m;
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t i = 0; i < kMostPoints; ++i)
    sample.push_back(near_m[i * near_m.size() / kMostPoints]);
  return sample;
}

}  // namespace

std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3d> points_m,
                                       const Eigen::Vector3d& sensor_m) {
  if (points_m.size() < 30) return std::nullopt;
  // The same random trials for each sweep.
  std::uint32_t state = 1;
  const auto any = [&]() -> const Eigen::Vector3d& {
    state = state * 1664525U + 1013904223U;
    return points_m[(state >> 8U) % points_m.size()];
  };

  std::optional<GroundPlane> best;
  std::ptrdiff_t most =
      static_cast<std::ptrdiff_t>(kShareOnPlane * static_cast<double>(points_m.size()));
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto plane = plane_through(any(), any(), any(), sensor_m);
    if (!plane || std::abs(plane->normal.z()) < kNoWall) continue;
    const auto on = std::ranges::count_if(
        points_m, [&](const Eigen::Vector3d& point) { return is_on(*plane, point, sensor_m); });
    if (on <= most) continue;
    most = on;
    best = plane;
  }
  if (!best) return std::nullopt;
  return refined(refined(*best, points_m, sensor_m), points_m, sensor_m);
}

void LaserCheck::add_raw(const model::PointSweep& raw) {
  if (parameters_.turns == "any" || !raw.has_times || raw.points.size() < 100) return;
  double turned = 0.0;
  double azimuth = std::atan2(raw.points.front().y_m, raw.points.front().x_m);
  float time_s = raw.points.front().time_s;
  const std::size_t step = 1 + raw.points.size() / kMostTurns;
  for (std::size_t i = step; i < raw.points.size(); i += step) {
    const model::SweepPoint& point = raw.points[i];
    if (point.time_s == time_s) continue;
    const double next = std::atan2(point.y_m, point.x_m);
    turned += std::remainder(next - azimuth, 2.0 * std::numbers::pi) *
              (point.time_s > time_s ? 1.0 : -1.0);
    azimuth = next;
    time_s = point.time_s;
  }

  // Points over less than half a turn give no direction.
  const bool is_round = std::abs(turned) > std::numbers::pi;
  turn_ += ((is_round ? std::copysign(1.0, turned) : 0.0) - turn_) / kRemembered;
  judge();
}

void LaserCheck::add(const model::PointSweep& sweep) {
  const auto ground = find_ground(sample_of(sweep), sweep.sensor_position_m);
  if (!ground) return;
  const double height_m = parameters_.mount.z_m;
  const double tolerance_m = kHeightTolerance_m + kHeightTolerance_share * std::abs(height_m);
  const bool is_above =
      ground->normal.z() < 0.0 && std::abs(ground->distance_m - height_m) < tolerance_m;
  seen_ += 1.0;
  above_ += ((is_above ? 1.0 : 0.0) - above_) / std::min(seen_, kRemembered);

  if (ground->normal.z() > 0.0 && way_m_ >= kApart_m) {
    way_m_ = 0.0;
    const Eigen::Vector3d off(ground->normal.x(), ground->normal.y(),
                              ground->distance_m - height_m);
    const double kept = count_ < kMostCount ? 1.0 : 1.0 - 1.0 / kMostCount;
    count_ = kept * count_ + 1.0;
    sum_ = kept * sum_ + off;
    squares_ = kept * squares_ + off.cwiseAbs2();
  }
  judge();
}

void LaserCheck::judge() {
  const double expected = parameters_.turns == "clockwise" ? -1.0 : 1.0;
  const Eigen::Array3d mean = sum_ / std::max(1.0, count_);
  const Eigen::Array3d sigma =
      ((squares_.array() / std::max(1.0, count_) - mean.square()).max(0.0) / std::max(1.0, count_))
          .sqrt();
  const Eigen::Array3d certain = mean.abs() - kSigmas * sigma;

  fault_ = LaserFault::kNone;
  if (parameters_.turns != "any" && turn_ * expected < -0.5) fault_ = LaserFault::kTurnsOtherWay;
  if (count_ >= kFewest && parameters_.mount.z_m > 0.0 && certain.z() > kMostHeightError_m)
    fault_ = LaserFault::kWrongHeight;
  if (count_ >= kFewest && certain.head<2>().maxCoeff() > kMostTilt_rad)
    fault_ = LaserFault::kTilted;
  if (seen_ >= kRemembered && above_ > kMostlyAbove) fault_ = LaserFault::kUpsideDown;
}

std::string LaserCheck::text() const {
  const Eigen::Vector3d mean = sum_ / std::max(1.0, count_);
  switch (fault_) {
    case LaserFault::kUpsideDown:
      return "the ground is above the laser: it is upside down, or its driver has turned z round";
    case LaserFault::kTilted:
      return fmt::format(
          "the ground is tilted on the mean over {:.0f} m: lidar.mount is {:.1f} deg off about x "
          "and {:.1f} deg about y",
          kApart_m * count_, mean.y() / kLaserDegree_rad, -mean.x() / kLaserDegree_rad);
    case LaserFault::kWrongHeight:
      return fmt::format(
          "the ground is {:.2f} m below it and not {:.2f} m: lidar.mount.z_m is wrong, or the unit "
          "of its ranges",
          parameters_.mount.z_m + mean.z(), parameters_.mount.z_m);
    case LaserFault::kTurnsOtherWay:
      return "its points do not come " + parameters_.turns +
             " (lidar.turns): its driver has turned an axis or the times round";
    case LaserFault::kNone:
      break;
  }
  return "";
}

}  // namespace understory::lidar_imu_input
