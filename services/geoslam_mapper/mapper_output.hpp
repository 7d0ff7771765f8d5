// Outputs of the mapper beside the values of common/model.
#pragma once

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper {

/// Pose of a single scan.
struct ScanPose {
  geometry::SE2WithCovariance map_T_vehicle;  ///< Right perturbation.
  /// From odometry alone since the last localised scan or keyframe: too few landmarks match.
  bool is_coasting = false;
};

/// Radius around the vehicle within which landmarks are reported anew [m].
inline constexpr double kAroundVehicle_m = 60.0;

}  // namespace understory::geoslam_mapper
