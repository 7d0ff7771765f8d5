// A detection that the associator can use.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::associator {

/// One usable detection of a scan, in the plane.
struct Observation {
  std::uint32_t detection = 0;                              ///< Index in the scan.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();     ///< Frame `vehicle_level`.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< Likewise; positive definite.
  double radius_m = 0.0;                                    ///< 0 where unknown.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;

  /// Isotropic variance of the position, per axis.
  double variance_m2() const { return 0.5 * covariance_m2.trace(); }
};

/// The detections that are finite and have a positive definite covariance, in the scan's order.
std::vector<Observation> usable_observations(const model::LandmarkScan& scan);

}  // namespace understory::associator
