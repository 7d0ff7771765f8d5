// A drive of any length among landmarks that are made where the vehicle comes by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"

namespace understory::eval::experiments::partition {

/// Where the vehicle drives, and among what.
struct RouteParameters {
  double length_m = 1000.0;
  /// > 0: laps round a block of that circumference; 0: a winding road that never comes back.
  double block_m = 0.0;
  double landmarks_per_km2 = 13'770.0;  ///< The forest of GeoSLAM §4.5.2.
  double range_m = 40.0;
  double sigma_m = 0.07;              ///< Of a keyframe's landmark, per axis.
  double detection = 0.9;             ///< Of a landmark in range, for each keyframe.
  double odometry_share = 0.01;       ///< 1 sigma of odometry, of the path.
  double odometry_heading_deg = 0.1;  ///< 1 sigma, for each keyframe.
};

/// Poses, keyframes and odometry of a route. Landmarks are drawn tile by tile, each from a stream
/// of its own, and kept only around the vehicle: a route of any length costs no memory.
class Route {
 public:
  /// The same seed gives the same route.
  Route(const RouteParameters& parameters, std::uint64_t seed);

  /// Number of keyframes.
  std::size_t size() const { return size_; }
  /// Path up to keyframe k [m].
  static double along_m(std::size_t k);
  /// The true pose of keyframe k in the frame of keyframe 0.
  geometry::SE2 pose(std::size_t k) const;
  /// The keyframe, with the time of its number. To be asked for in order.
  model::Keyframe keyframe(std::size_t k);
  /// Odometry from keyframe k - 1; k > 0. To be asked for in order.
  model::Odometry odometry(std::size_t k);
  /// Number of a keyframe of that time.
  static std::size_t number_of(model::Utime utime);

 private:
  double heading_of_road(double along_m) const;
  geometry::SE2 on_block(double along_m) const;
  std::vector<Eigen::Vector2d> tile(int x, int y) const;
  double unit() { return normal_(random_); }

  RouteParameters parameters_;
  std::uint64_t seed_;
  std::size_t size_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  std::vector<double> phases_;
  std::vector<geometry::SE2> poses_;  ///< Of every keyframe.
};

}  // namespace understory::eval::experiments::partition
