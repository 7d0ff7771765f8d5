// The paths that the simulated robot drives (GeoSLAM §4.5.3, Fig. 4.7).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::sim {

/// The shapes of paths.
enum class PathKind {
  kCircle,        ///< To the left.
  kLine,          ///< Straight ahead.
  kFigureEight,   ///< A left circle, then a right one, each of half the length.
  kSquare,        ///< Rotations to the left on the spot by 90 degrees.
  kTriangle,      ///< Rotations to the left on the spot by 120 degrees.
  kDoubleCircle,  ///< Two rounds to the right: what GeoSLAM's code drove as its figure-eight.
  kMeander,       ///< Parallel lanes in alternating directions, for long drives in a small forest.
  kStationary,    ///< Stationary; an observation at every interval of the length.
};

/// Shape, length and spacing of a path.
struct PathParameters {
  PathKind kind = PathKind::kCircle;
  double length_m = 200.0;       ///< Driven; rotations on the spot are extra.
  double interval = 0.2;         ///< Between observations: metres driven or radians rotated.
  double lane_length_m = 600.0;  ///< Meander only.
  double lane_spacing_m = 60.0;  ///< Meander only.
};

/// The name that path_kind() takes.
std::string_view to_string(PathKind kind);
/// By name, e.g. "figure-eight"; none for another.
std::optional<PathKind> path_kind(std::string_view name);
/// All names that path_kind() takes.
std::vector<std::string> path_names();

/// The poses of the vehicle (x forward) in the frame of the first, at every observation. A step
/// that reaches a corner spends what is left of it rotating, metres as radians, and vice versa.
/// The path ends where its length is driven, with no last rotation and no observation there.
std::vector<geometry::SE2> make_path(const PathParameters& parameters);

}  // namespace understory::sim
