// A laser beside the ground: upside down, tilted, at another height, turning the other way.
#include <algorithm>
#include <numbers>
#include <random>

#include "services/lidar_imu_input/laser_check.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

namespace {

constexpr double kLaserTestDegree_rad = std::numbers::pi / 180.0;

DeskewParameters laser_at(double height_m) {
  DeskewParameters parameters;
  parameters.mount.z_m = height_m;
  parameters.turns = "clockwise";
  return parameters;
}

/// A revolution of 16 beams over ground whose slope against the vehicle is drawn, with stems; frame
/// sensor, whose place is `height_m` above the ground.
model::PointSweep revolution(double height_m, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> any(0.0, 1.0);
  const Eigen::Vector3d up = Eigen::Vector3d(0.02 * normal(random), 0.02 * normal(random), 1.0);
  model::PointSweep sweep;
  sweep.rings = 16;
  for (int column = 0; column < 360; ++column) {
    const double stem_m = any(random) < 0.3 ? 4.0 + 15.0 * any(random) : 1e9;
    for (int ring = 0; ring < 16; ++ring) {
      const double azimuth = -kLaserTestDegree_rad * column;
      const double elevation = kLaserTestDegree_rad * (2.0 * ring - 15.0);
      const Eigen::Vector3d beam(std::cos(elevation) * std::cos(azimuth),
                                 std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double falls = -beam.dot(up);
      const double range_m =
          std::min(stem_m, falls > 0.0 ? height_m * up.z() / falls : 1e9) + 0.03 * normal(random);
      if (range_m > 100.0) continue;
      const Eigen::Vector3f point = (range_m * beam).cast<float>();
      model::SweepPoint& one = sweep.points.emplace_back();
      one.x_m = point.x();
      one.y_m = point.y();
      one.z_m = point.z();
      one.time_s = 0.1F * static_cast<float>(column) / 360.0F;
      one.ring = static_cast<std::uint16_t>(ring);
    }
  }
  return sweep;
}

/// What is found on 40 m of way, where points are changed before.
LaserCheck after_way(const Eigen::Matrix3d& points, std::mt19937_64& random) {
  constexpr double kHeight_m = 1.9;
  LaserCheck check(laser_at(kHeight_m));
  for (int k = 0; k < 80; ++k) {
    model::PointSweep sweep = revolution(kHeight_m, random);
    for (model::SweepPoint& point : sweep.points) {
      const Eigen::Vector3f moved = points.cast<float>() * point.position();
      point.x_m = moved.x();
      point.y_m = moved.y();
      point.z_m = moved.z();
    }
    check.add_raw(sweep);

    for (model::SweepPoint& point : sweep.points) point.z_m += static_cast<float>(kHeight_m);
    sweep.sensor_position_m = {0.0, 0.0, kHeight_m};
    check.travel(0.5);
    check.add(sweep);
  }
  return check;
}

Eigen::Matrix3d tilted(double degrees, double heading_rad) {
  const Eigen::Vector3d axis(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  return Eigen::AngleAxisd(degrees * kLaserTestDegree_rad, axis).toRotationMatrix();
}

}  // namespace

TEST_CASE("A laser that is mounted as configured is sound on any slope", "[laser]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    const LaserCheck check = after_way(Eigen::Matrix3d::Identity(), random);
    CHECK(check.fault() == LaserFault::kNone);
    CHECK(check.text().empty());
  }
}

TEST_CASE("The ground shows a laser upside down, tilted, and ranges of another unit", "[laser]") {
  std::uniform_real_distribution<double> heading(-std::numbers::pi, std::numbers::pi);
  std::uniform_real_distribution<double> degrees(6.0, 20.0);
  Eigen::Matrix3d mirrored = Eigen::Matrix3d::Identity();
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    std::mt19937_64 random(seed);
    mirrored.diagonal() = Eigen::Vector3d(1.0, 1.0, -1.0);
    CHECK(after_way(tilted(180.0, heading(random)), random).fault() == LaserFault::kUpsideDown);
    CHECK(after_way(mirrored, random).fault() == LaserFault::kUpsideDown);
    CHECK(after_way(tilted(degrees(random), heading(random)), random).fault() ==
          LaserFault::kTilted);
    CHECK(after_way(1.09 * Eigen::Matrix3d::Identity(), random).fault() ==
          LaserFault::kWrongHeight);
  }
}

TEST_CASE("Points that come the other way round show an axis or times turned round", "[laser]") {
  std::mt19937_64 random(1);
  Eigen::Matrix3d mirrored = Eigen::Matrix3d::Identity();
  mirrored(1, 1) = -1.0;
  CHECK(after_way(mirrored, random).fault() == LaserFault::kTurnsOtherWay);

  LaserCheck any_way([] {
    DeskewParameters parameters = laser_at(1.9);
    parameters.turns = "any";
    return parameters;
  }());
  LaserCheck reversed(laser_at(1.9));
  for (int k = 0; k < 40; ++k) {
    model::PointSweep sweep = revolution(1.9, random);
    for (model::SweepPoint& point : sweep.points) point.time_s = 0.1F - point.time_s;
    std::ranges::reverse(sweep.points);
    any_way.add_raw(sweep);
    reversed.add_raw(sweep);
  }
  CHECK(any_way.fault() == LaserFault::kNone);
  CHECK(reversed.fault() == LaserFault::kTurnsOtherWay);
}
