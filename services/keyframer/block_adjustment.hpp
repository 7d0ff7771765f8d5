// Joint maximum-likelihood estimate of a few scans' poses and the landmarks that they saw.
#pragma once

#include <optional>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::keyframer {

/// One detection of landmark `landmark` by member `member`.
struct BlockObservation {
  std::uint32_t member = 0;
  std::uint32_t landmark = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();     ///< Frame of the member's vehicle.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< Likewise.
};

struct BlockProblem {
  std::vector<geometry::SE2> local_T_member;  ///< First guess, in any frame `local`.
  std::vector<Eigen::Vector2d> landmarks;     ///< First guess, same frame.
  std::vector<BlockObservation> observations;
  /// motion[k]: from member k to member k + 1, where odometry knows it; size members - 1.
  std::vector<std::optional<geometry::SE2WithCovariance>> motion;
};

/// The estimate in the frame `centre`.
///
/// The free motion of the whole is fixed by asking that the members' pose errors sum to zero (inner
/// constraint): in that gauge the landmarks' errors are as independent as they can be.
/// `landmark_covariance` are the exact 2 x 2 blocks in that gauge.
struct BlockEstimate {
  bool converged = false;
  std::vector<geometry::SE2WithCovariance> centre_T_member;
  std::vector<Eigen::Vector2d> landmarks;
  std::vector<Eigen::Matrix2d> landmark_covariance;
  std::vector<double> chi2;  ///< Per observation, 2 degrees of freedom, after the fit.
};

/// Gauss-Newton with the landmarks eliminated (Schur complement on the 3n pose parameters); cost
/// O(observations n + n^3).
BlockEstimate adjust_block(const BlockProblem& problem);

}  // namespace understory::keyframer
