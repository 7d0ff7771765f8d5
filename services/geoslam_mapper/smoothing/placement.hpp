// Predicted pose and placement of a keyframe.
#pragma once

#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The expected pose of a keyframe's centre, frame `map`.
struct Prediction {
  geometry::SE2WithCovariance map_T_centre;
  bool from_odometry = false;  ///< False: from the keyframer's tracking, with assumed noise.
};

/// Pose of a keyframe, and the associations of its landmarks with the map's.
struct Placement {
  geometry::SE2WithCovariance map_T_centre;
  std::vector<model::Association> associations;
  bool by_prediction = false;  ///< False: by search of the whole map.
  /// Landmarks around whose association is ambiguous by position, ascending: see PassJoiner.
  std::vector<model::LandmarkId> loose;
};

}  // namespace understory::geoslam_mapper::smoothing
