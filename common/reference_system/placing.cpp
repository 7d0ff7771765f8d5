#include "common/reference_system/placing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/alignment.hpp"

namespace understory::reference_system {
namespace {

constexpr double kLeastReach_m = 1.0;
constexpr int kMostFrames = 10;
constexpr int kWeightRounds = 30;
/// Largest difference of equal frames.
constexpr double kSame_m = 2e-5;
constexpr double kSame_rad = 1e-9;

using Places = std::vector<Eigen::Vector2d>;

Places placed_in(const Transformation& into, std::span<const CommonPoint> points) {
  Places places;
  places.reserve(points.size());
  for (const CommonPoint& one : points) places.push_back(into.forward(one.world));
  return places;
}

std::vector<double> distances_m(const Places& places, std::span<const CommonPoint> points,
                                const geometry::SE2& frame_T_map) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    distances.push_back((places[i] - frame_T_map * points[i].map_m).norm());
  return distances;
}

geometry::SE2 fitted(const Places& places, std::span<const CommonPoint> points) {
  std::vector<double> errors_m(points.size(), 0.0);
  geometry::SE2 frame_T_map;
  for (int round = 0; round < kWeightRounds; ++round) {
    geometry::RigidAlignment2 alignment;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double sigma_m = points[i].sigma_m;
      alignment.add(places[i], points[i].map_m, 1.0 / (sigma_m * std::max(sigma_m, errors_m[i])));
    }
    frame_T_map = alignment.a_T_b();
    errors_m = distances_m(places, points, frame_T_map);
  }
  return frame_T_map;
}

Eigen::Vector2d middle_of(const Places& places) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& one : places) sum += one;
  return sum / static_cast<double>(places.size());
}

/// Root of the sum of squared distances of the points from their mean.
double spread_m(const Places& places) {
  const Eigen::Vector2d middle = middle_of(places);
  double squares = 0.0;
  for (const Eigen::Vector2d& one : places) squares += (one - middle).squaredNorm();
  return std::sqrt(squares);
}

double reach_of(const Places& places) {
  const Eigen::Vector2d middle = middle_of(places);
  double reach_m = 0.0;
  for (const Eigen::Vector2d& one : places) reach_m = std::max(reach_m, (one - middle).norm());
  return reach_m;
}

Places map_places(std::span<const CommonPoint> points) {
  Places places;
  places.reserve(points.size());
  for (const CommonPoint& one : points) places.push_back(one.map_m);
  return places;
}

}  // namespace

Placing place_map(const std::string& system, std::span<const CommonPoint> points) {
  if (points.size() < 2)
    throw ReferenceError(
        fmt::format("{} points are known in both: two or more are needed", points.size()));
  const Places in_map = map_places(points);
  Placing placing;
  placing.reach_m = reach_of(in_map);
  if (placing.reach_m < kLeastReach_m)
    throw ReferenceError("the points lie within 1 m of each other: they show no direction");

  placing.reference = frame_at(system, points.front().world);
  // North differs from place to place: iterate until the frame is at the map's origin.
  for (int i = 0; i < kMostFrames; ++i) {
    const Transformation into = into_frame(system, placing.reference);
    const Places places = placed_in(into, points);
    const geometry::SE2 frame_T_map = fitted(places, points);
    placing.residuals_m = distances_m(places, points, frame_T_map);
    placing.scale = spread_m(places) / spread_m(in_map);
    const bool is_settled =
        frame_T_map.translation().norm() < kSame_m && std::abs(frame_T_map.theta()) < kSame_rad;
    if (is_settled) break;
    placing.reference = frame_at(system, into.inverse(frame_T_map.translation()),
                                 placing.reference.rotation_rad + frame_T_map.theta());
  }

  double squares = 0.0;
  for (const double one : placing.residuals_m) squares += one * one;
  placing.rms_m = std::sqrt(squares / static_cast<double>(points.size()));
  return placing;
}

}  // namespace understory::reference_system
