// The best pose around a pose that chance does not explain, and its covariance.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/constellation/pose.hpp"

namespace understory::constellation {

/// A settled pose.
struct SettledPose {
  FittedPose pose;                                       ///< With the pairs at the settled pose.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  /// Decades between the likelihoods of the settled pose and of the next maximum around it; 1e3
  /// where no other was found.
  double log10_margin = 1e3;
  std::uint32_t lookups = 0;  ///< Look-ups of points in the map (the cost).
};

/// A pose fitted to nearest neighbours can be metres wrong where a third of the points has wrong
/// landmarks: it passes the test against chance and states a sigma of centimetres. Here every point
/// may belong to every landmark around it or to none (mixture.hpp). The maximum is sought from the
/// given pose and from smoothed versions of the mixture, whose maxima attract from metres away. The
/// covariance is the inverse of the information without known associations. None where that is not
/// positive definite.
///
/// O(points * landmarks near a point), about 30 times; more where few points are explained.
std::optional<SettledPose> settle(const PreparedObservation& observation, const PointGrid& grid,
                                  const FittedPose& start, const LocaliseParameters& parameters);

}  // namespace understory::constellation
