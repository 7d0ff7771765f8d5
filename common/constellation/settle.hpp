// From a pose that chance does not explain to the best one around it, and how well it is known.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/constellation/pose.hpp"

namespace understory::constellation {

/// A settled pose.
struct SettledPose {
  FittedPose pose;                                       ///< With the pairs at the settled pose.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  /// Decades by which the settled pose explains the observation better than the next maximum found
  /// around it; none found: very many.
  double log10_margin = 1e3;
  std::uint32_t lookups = 0;  ///< The work done.
};

/// A pose fitted to nearest neighbours can be stuck metres beside the right one, where a third of
/// the points finds other landmarks: acceptable to chance, and stated to centimetres. Here every
/// point may be of every landmark around it or of none (mixture.hpp), and the maximum is sought
/// from the pose as it is and from smoothed versions of the mixture, whose maxima attract from
/// metres away. The covariance is the inverse of the information that is left where it is not known
/// which landmark a point is of. None where that is not positive definite.
///
/// O(points * landmarks near a point), about 30 times; more where few of the points are explained.
std::optional<SettledPose> settle(const PreparedObservation& observation, const PointGrid& grid,
                                  const FittedPose& start, const LocaliseParameters& parameters);

}  // namespace understory::constellation
