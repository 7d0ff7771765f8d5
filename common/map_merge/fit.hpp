// The motion that two maps' common landmarks give, and how well it is known.
#pragma once

#include <span>

#include "common/map_merge/pairing.hpp"

namespace understory::map_merge {

/// Least squares over pairs.
struct MotionFit {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of the motion; right perturbation.
  DifferenceModel model;                                 ///< With the motion.
};

/// Gauss-Newton from `start`, with both covariances. Precondition: two pairs at different places or
/// more. What the pairs leave shows how much of the stated covariances is independent from landmark
/// to landmark; a rigid motion common to all is fitted to the rest of them. The covariance is that
/// of independent errors and that motion. O(pairs).
MotionFit fit_motion(const LandmarkSet& first, const LandmarkSet& second,
                     std::span<const LandmarkPair> pairs, const geometry::SE2& start);

}  // namespace understory::map_merge
