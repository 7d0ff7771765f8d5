// Where a keyframe is thought to be, and where it was found.
#pragma once

#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The expected pose of a keyframe's centre, frame `map`.
struct Prediction {
  geometry::SE2WithCovariance map_T_centre;
  bool from_odometry = false;  ///< False: from what the keyframer tracked, with assumed noise.
};

/// Where a keyframe is, and which of its landmarks are which of the map's.
struct Placement {
  geometry::SE2WithCovariance map_T_centre;
  std::vector<model::Association> associations;
  bool by_prediction = false;  ///< False: by search of the whole map.
  /// Landmarks around that may be any of several by where they are, ascending: see PassJoiner.
  std::vector<model::LandmarkId> loose;
};

}  // namespace understory::geoslam_mapper::smoothing
