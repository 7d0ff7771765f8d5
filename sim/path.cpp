#include "sim/path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::sim {
namespace {

using std::numbers::pi;

constexpr std::array<std::pair<PathKind, std::string_view>, 8> kPathNames{
    {{PathKind::kCircle, "circle"},
     {PathKind::kLine, "line"},
     {PathKind::kFigureEight, "figure-eight"},
     {PathKind::kSquare, "square"},
     {PathKind::kTriangle, "triangle"},
     {PathKind::kDoubleCircle, "double-circle"},
     {PathKind::kMeander, "meander"},
     {PathKind::kStationary, "stationary"}}};

/// A stretch with constant twist: `effort` is its cost in metres or radians.
struct Segment {
  double effort = 0.0;
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< Per unit of effort.
};

Segment straight(double length_m) { return {length_m, {1, 0, 0}}; }
Segment arc(double length_m, double curvature) { return {length_m, {1, 0, curvature}}; }
Segment turn(double angle_rad) { return {angle_rad, {0, 0, 1}}; }

std::vector<Segment> polygon(double length_m, int sides) {
  std::vector<Segment> segments;
  for (int i = 0; i < sides; ++i) {
    if (i > 0) segments.push_back(turn(2.0 * pi / sides));
    segments.push_back(straight(length_m / sides));
  }
  return segments;
}

std::vector<Segment> meander(const PathParameters& parameters) {
  std::vector<Segment> segments;
  const double curvature = 2.0 / parameters.lane_spacing_m;
  double left = parameters.length_m;
  for (int lane = 0; left > 0.0; ++lane) {
    segments.push_back(straight(std::min(left, parameters.lane_length_m)));
    left -= segments.back().effort;
    if (left <= 0.0) break;
    segments.push_back(arc(std::min(left, pi / curvature), lane % 2 == 0 ? curvature : -curvature));
    left -= segments.back().effort;
  }
  return segments;
}

std::vector<Segment> segments_of(const PathParameters& parameters) {
  const double length = parameters.length_m;
  const double round = 2.0 * pi / length;  // curvature of one circle of the whole length
  switch (parameters.kind) {
    case PathKind::kCircle:
      return {arc(length, round)};
    case PathKind::kLine:
      return {straight(length)};
    case PathKind::kFigureEight:
      return {arc(0.5 * length, 2.0 * round), arc(0.5 * length, -2.0 * round)};
    case PathKind::kSquare:
      return polygon(length, 4);
    case PathKind::kTriangle:
      return polygon(length, 3);
    case PathKind::kDoubleCircle:
      return {arc(length, -2.0 * round)};
    case PathKind::kMeander:
      return meander(parameters);

    case PathKind::kStationary:
      return {{length, Eigen::Vector3d::Zero()}};
  }

  return {};
}

}  // namespace

std::string_view to_string(PathKind kind) {
  for (const auto& [value, name] : kPathNames) {
    if (value == kind) return name;
  }
  return "?";
}

std::optional<PathKind> path_kind(std::string_view name) {
  for (const auto& [value, known] : kPathNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> path_names() {
  std::vector<std::string> names;
  names.reserve(kPathNames.size());
  for (const auto& [value, name] : kPathNames) names.emplace_back(name);
  return names;
}

std::vector<geometry::SE2> make_path(const PathParameters& parameters) {
  std::vector<geometry::SE2> poses;
  geometry::SE2 segment_start;
  double effort_before = 0.0;

  // An observation within rounding of the end of a segment belongs to the next one.
  const double slack = 1e-6 * parameters.interval;
  for (const Segment& segment : segments_of(parameters)) {
    const double effort_end = effort_before + segment.effort;
    for (;;) {
      const double effort = static_cast<double>(poses.size()) * parameters.interval;
      if (effort >= effort_end - slack) break;
      poses.push_back(segment_start *
                      geometry::SE2::Exp(std::max(0.0, effort - effort_before) * segment.twist));
    }
    segment_start = segment_start * geometry::SE2::Exp(segment.effort * segment.twist);
    effort_before = effort_end;
  }

  return poses;
}

}  // namespace understory::sim
