// What a laser that scans in space sees of stems, walls and a sloping ground.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/model/point_sweep.hpp"

namespace understory::test {

struct Stem {
  Eigen::Vector2d breast{0.0, 0.0};  ///< Centre 1.3 m above the ground.
  double radius = 0.15;              ///< There.
  Eigen::Vector2d lean{0.0, 0.0};    ///< Horizontal change of the axis per metre of height.
  double taper = 0.0;                ///< Loss of radius per metre.
  double top = 15.0;                 ///< Above ground.
  double bottom = 0.0;
};

/// An upright rectangle from the ground to `top`, with waves along it.
struct Facade {
  Eigen::Vector2d from{0.0, 0.0};
  Eigen::Vector2d to{0.0, 0.0};
  double top = 5.0;
  double wave = 0.0;  ///< Amplitude, across.
  double wave_length = 1.0;
  double phase = 0.0;
};

struct Space {
  std::vector<Stem> stems;
  std::vector<Facade> facades;
  Eigen::Vector2d slope{0.0, 0.0};  ///< Rise of the ground per metre; height 0 at the vehicle.

  double ground(const Eigen::Vector2d& at) const { return slope.dot(at); }
};

/// A spinning laser 1.8 m above the origin of the vehicle.
struct Spinner {
  int rings = 32;
  int columns = 1024;
  double lowest_rad = -0.4;
  double highest_rad = 0.2;
  double sigma_m = 0.02;
  double drop_out = 0.01;
  Eigen::Vector3d sensor{0.0, 0.0, 1.8};

  double elevation(int ring) const {
    return lowest_rad + (highest_rad - lowest_rad) * ring / (rings - 1.0);
  }
};

inline Spinner spinner_of(int rings) {
  if (rings == 16)
    return {.rings = 16, .columns = 1800, .lowest_rad = -0.262, .highest_rad = 0.262};
  if (rings == 64) return {.rings = 64, .columns = 2048, .lowest_rad = -0.43, .highest_rad = 0.035};
  return {.rings = rings, .columns = 2048};
}

constexpr double kMiss = std::numeric_limits<double>::infinity();

/// Range along the unit ray; exact for cones by iterating on the height of the hit.
inline double hit(const Stem& stem, const Space& space, const Eigen::Vector3d& o,
                  const Eigen::Vector3d& d) {
  const double ground = space.ground(stem.breast);
  // |xy(t) - breast - lean (z - zb)|^2 = (r - taper (z - zb))^2, quadratic in t.
  const double z0 = o.z() - ground - 1.3;
  const Eigen::Vector2d p = o.head<2>() - stem.breast - stem.lean * z0;
  const Eigen::Vector2d q = d.head<2>() - stem.lean * d.z();
  const double r0 = stem.radius - stem.taper * z0;
  const double r1 = -stem.taper * d.z();
  const double a = q.squaredNorm() - r1 * r1;
  const double b = p.dot(q) - r0 * r1;
  const double c = p.squaredNorm() - r0 * r0;
  const double root = b * b - a * c;
  if (root < 0.0 || a <= 0.0) return kMiss;
  const double t = (-b - std::sqrt(root)) / a;
  const double height = o.z() + t * d.z() - ground;
  return t > 0.0 && height > stem.bottom && height < stem.top ? t : kMiss;
}

inline double hit(const Facade& wall, const Space& space, const Eigen::Vector3d& o,
                  const Eigen::Vector3d& d) {
  const Eigen::Vector2d along = wall.to - wall.from;
  const Eigen::Vector2d start = wall.from - o.head<2>();
  const double det = d.x() * along.y() - d.y() * along.x();
  if (std::abs(det) < 1e-12) return kMiss;
  const double t = (start.x() * along.y() - start.y() * along.x()) / det;
  const double part = (start.x() * d.y() - start.y() * d.x()) / det;
  const double z = o.z() + t * d.z();
  // Waves are so low that the beam meets them about where it would meet the plane.
  const double turns = part * along.norm() / wall.wave_length;
  const double across = wall.wave * std::sin(2.0 * std::numbers::pi * turns + wall.phase);
  const double before = across * along.norm() / det;
  return t > 0.0 && part >= 0.0 && part <= 1.0 &&
                 z < space.ground(wall.from + part * along) + wall.top
             ? t + before
             : kMiss;
}

inline double hit_ground(const Space& space, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const double fall = d.z() - space.slope.dot(d.head<2>());
  const double t = (space.slope.dot(o.head<2>()) - o.z()) / fall;
  return fall < -1e-9 && t > 0.0 ? t : kMiss;
}

/// The turn of a standing vehicle with the given attitude; points in frame `vehicle`.
inline model::PointSweep sweep(
    const Space& space, const Spinner& spinner, std::mt19937_64& random,
    const Eigen::Quaterniond& level_Q_vehicle = Eigen::Quaterniond::Identity()) {
  model::PointSweep result;
  result.is_deskewed = true;
  result.rings = static_cast<std::uint16_t>(spinner.rings);
  result.max_range_m = 80.0;
  result.sensor_position_m = spinner.sensor;
  result.attitude = model::Attitude{level_Q_vehicle, Eigen::Matrix2d::Zero()};
  std::normal_distribution<double> noise(0.0, spinner.sigma_m);
  std::uniform_real_distribution<double> luck(0.0, 1.0);
  const Eigen::Vector3d origin = level_Q_vehicle * spinner.sensor;
  // Velodynes turn clockwise and begin anywhere.
  const double begin = luck(random) * 2.0 * std::numbers::pi;
  for (int column = 0; column < spinner.columns; ++column) {
    const double azimuth = begin - 2.0 * std::numbers::pi * column / spinner.columns;
    for (int ring = 0; ring < spinner.rings; ++ring) {
      const double e = spinner.elevation(ring);
      const Eigen::Vector3d beam(std::cos(e) * std::cos(azimuth), std::cos(e) * std::sin(azimuth),
                                 std::sin(e));
      const Eigen::Vector3d d = level_Q_vehicle * beam;
      double range = hit_ground(space, origin, d);
      for (const Stem& stem : space.stems) range = std::min(range, hit(stem, space, origin, d));
      for (const Facade& wall : space.facades) {
        range = std::min(range, hit(wall, space, origin, d));
      }
      if (range > result.max_range_m || luck(random) < spinner.drop_out) continue;
      const Eigen::Vector3d p = spinner.sensor + (range + noise(random)) * beam;
      result.points.push_back(
          {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
           static_cast<float>(0.1 * (column - spinner.columns) / spinner.columns),
           static_cast<std::uint16_t>(ring), 0});
    }
  }
  return result;
}

}  // namespace understory::test
