#include "sim/route.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::sim {
namespace {

constexpr double kStep = 0.5;
constexpr int kBeyond = 8;  ///< Control points that extend each end, for a straight run-out.

using Points = std::vector<Eigen::Vector2d>;

/// Points every `step_m` along the polyline. The last one is at most half a step from its end.
Points resampled(std::span<const Eigen::Vector2d> polyline, double step_m) {
  Points result{polyline.front()};
  double covered = 0.0;  // of the polyline, up to the start of the present leg
  for (std::size_t i = 1; i < polyline.size(); ++i) {
    const Eigen::Vector2d leg = polyline[i] - polyline[i - 1];
    const double length = leg.norm();
    if (length == 0.0) continue;
    for (;;) {
      const double at = static_cast<double>(result.size()) * step_m - covered;
      if (at > length) break;
      result.push_back(polyline[i - 1] + at / length * leg);
    }
    covered += length;
  }

  return result;
}

/// Straight on by `count` steps beyond both ends.
Points extended(const Points& points, int count) {
  const Eigen::Vector2d start_step = points[1] - points[0];
  const Eigen::Vector2d end_step = points.back() - points[points.size() - 2];
  Points result;
  result.reserve(points.size() + 2 * count);
  for (int i = count; i > 0; --i) result.push_back(points.front() - i * start_step);
  result.insert(result.end(), points.begin(), points.end());
  for (int i = 1; i <= count; ++i) result.push_back(points.back() + i * end_step);
  return result;
}

/// Mean over 2 * half + 1 neighbours; shorter by `half` at both ends.
Points box_smoothed(const Points& points, int half) {
  Points result;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const std::size_t width = 2 * static_cast<std::size_t>(half) + 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += points[i];
    if (i + 1 >= width) {
      result.emplace_back(sum / static_cast<double>(width));
      sum -= points[i + 1 - width];
    }
  }
  return result;
}

}  // namespace

Route Route::through(std::span<const Eigen::Vector2d> waypoints_m, double rounding_m) {
  if (waypoints_m.size() < 2) throw std::runtime_error("a route needs two points");
  const double fine_m = 0.1;
  Points points = resampled(waypoints_m, fine_m);
  if (points.size() < 10) throw std::runtime_error("a route must be 1 m long at least");

  const int half = static_cast<int>(std::lround(0.5 * rounding_m / fine_m));
  points = extended(points, 3 * half);
  for (int i = 0; i < 3; ++i) points = box_smoothed(points, half);

  // Smoothing shortened the path in curves: restores equal spacing.
  points = resampled(points, kStep);
  Route route;
  route.length_m_ = kStep * static_cast<double>(points.size() - 1);
  route.start_ = kStep * kBeyond;
  route.curve_ = UniformSpline<2>(extended(points, kBeyond), kStep);

  return route;
}

Route::Place Route::at(double along_m) const {
  const auto value = curve_.at(start_ + std::clamp(along_m, 0.0, length_m_));
  const Eigen::Vector2d& v = value.first;
  const double speed = v.norm();
  return {value.position, std::atan2(v.y(), v.x()),
          (v.x() * value.second.y() - v.y() * value.second.x()) / (speed * speed * speed)};
}

geometry::SE2 Route::pose(double along_m) const {
  const Place place = at(along_m);
  return {place.position_m, place.heading_rad};
}

std::vector<Eigen::Vector2d> Route::places(double spacing_m) const {
  std::vector<Eigen::Vector2d> result;
  for (double s = 0.0; s < length_m_; s += spacing_m) result.push_back(at(s).position_m);
  result.push_back(at(length_m_).position_m);
  return result;
}

Route Route::moved(const geometry::SE2& world_T_route) const {
  Points points = curve_.points();
  for (Eigen::Vector2d& p : points) p = world_T_route * p;
  Route route = *this;
  route.curve_ = UniformSpline<2>(std::move(points), kStep);
  return route;
}

}  // namespace understory::sim
