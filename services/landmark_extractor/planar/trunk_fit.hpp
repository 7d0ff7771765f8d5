// Fit of a circle to the returns of one object.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/segments.hpp"

namespace understory::landmark_extractor::planar {

/// A trunk in polar coordinates about the laser's position at that time.
struct TrunkFit {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();  ///< Of the laser, frame of the beams.
  double range_m = 0.0;                                ///< Of the centre.
  double bearing_rad = 0.0;                            ///< Of the centre.
  double radius_m = 0.0;
  /// Of (range, bearing, radius) [m, rad, m].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Mean square of the ranges' residuals, in their standard deviations.
  double mean_square_residual = 0.0;

  /// Centre in the frame of the beams [m].
  Eigen::Vector2d centre() const;
  /// Its covariance [m^2].
  Eigen::Matrix2d centre_covariance() const;
};

/// Maximum a posteriori estimate of centre and radius. Measurements: the range of each beam, the
/// bearings of visible edges (`Border::kClear`), and the prior of the radius, which dominates for a
/// distant trunk narrower than a beam. None if the iteration does not converge to a circle in front
/// of the sensor.
std::optional<TrunkFit> fit_trunk(const Beams& scan, const Segment& segment,
                                  const PlanarTrunkParameters& parameters);

}  // namespace understory::landmark_extractor::planar
