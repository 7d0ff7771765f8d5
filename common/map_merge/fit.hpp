// The motion from two maps' common landmarks, and its covariance.
#pragma once

#include <span>

#include "common/map_merge/pairing.hpp"

namespace understory::map_merge {

/// Least squares over pairs.
struct MotionFit {
  /// Covariance of the motion; right perturbation.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  DifferenceModel model;  ///< Model of differences at the motion.
};

/// Gauss-Newton from `start`, with both covariances. Precondition: at least two pairs at different
/// positions. The residuals of the pairs show which part of the stated covariances is independent
/// from landmark to landmark; a common rigid motion is fitted to the rest. The covariance combines
/// independent errors and this common motion. O(pairs).
MotionFit fit_motion(const LandmarkSet& first, const LandmarkSet& second,
                     std::span<const LandmarkPair> pairs, const geometry::SE2& start);

}  // namespace understory::map_merge
