// The paths that the simulated robot drives (GeoSLAM §4.5.3, Fig. 4.7).
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::sim {

enum class PathKind {
  kCircle,        ///< To the left.
  kLine,          ///< Straight ahead.
  kFigureEight,   ///< A left circle, then a right one, each of half the length.
  kSquare,        ///< Left turns on the spot of 90 degrees.
  kTriangle,      ///< Left turns on the spot of 120 degrees.
  kDoubleCircle,  ///< Two rounds to the right: what the source's code drove as its figure-eight.
  kMeander,       ///< Parallel lanes to and fro, for long drives in a small forest.
  kStanding,      ///< Does not move; an observation at every interval of the length.
};

struct PathParameters {
  PathKind kind = PathKind::kCircle;
  double length_m = 200.0;       ///< Driven; turns on the spot are extra.
  double interval = 0.2;         ///< Between observations: metres driven or radians turned.
  double lane_length_m = 600.0;  ///< Meander only.
  double lane_spacing_m = 60.0;  ///< Meander only.
};

std::string_view to_string(PathKind kind);
std::optional<PathKind> path_kind(std::string_view name);

/// The poses of the vehicle (x forward) in the frame of the first, at every observation. A step
/// that reaches a corner spends what is left of it turning, metres as radians, and the other way
/// round. The path ends where its length is driven, with no last turn and no observation there.
std::vector<geometry::SE2> make_path(const PathParameters& parameters);

}  // namespace understory::sim
