// The paths of the simulated robot (GeoSLAM §4.5.3, Fig. 4.7).
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
  kDoubleCircle,  ///< Two rounds to the right: the figure-eight of GeoSLAM's code.
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

/// The name accepted by path_kind().
std::string_view to_string(PathKind kind);
/// By name, e.g. "figure-eight"; none for another.
std::optional<PathKind> path_kind(std::string_view name);
/// All names accepted by path_kind().
std::vector<std::string> path_names();

/// The poses of the vehicle (x forward) in the frame of the first, at every observation. At a
/// corner the rest of a step is used for rotation, metres as radians, and vice versa. The path ends
/// when its length is driven, without a last rotation and an observation there.
std::vector<geometry::SE2> make_path(const PathParameters& parameters);

}  // namespace understory::sim
