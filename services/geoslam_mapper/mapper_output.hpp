// What the mapper gives beside the values of common/model.
#pragma once

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper {

/// Where a single scan was made.
struct ScanPose {
  geometry::SE2WithCovariance map_T_vehicle;  ///< Right perturbation.
  /// By odometry alone, from the last scan or keyframe that was located: landmarks ended.
  bool is_coasting = false;
};

/// Landmarks that are nearer to the vehicle than this are around it [m].
inline constexpr double kAroundVehicle_m = 60.0;

}  // namespace understory::geoslam_mapper
