// Joint maximum-likelihood estimate of the poses of a few scans and of their landmarks.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/se2.hpp"
#include "services/keyframer/joint/inertial_chain.hpp"

namespace understory::keyframer::joint {

/// One detection of landmark `landmark` by member `member`.
struct BlockObservation {
  std::uint32_t member = 0;                                 ///< Index in local_T_member.
  std::uint32_t landmark = 0;                               ///< Index in landmarks.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();     ///< Frame of the member's vehicle.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< Likewise; positive definite.
  std::uint32_t detection = 0;                              ///< Index in the member's scan.
};

/// Unknowns and measurements.
struct BlockProblem {
  std::vector<geometry::SE2> local_T_member;  ///< Initial guess, in any frame `local`.
  std::vector<Eigen::Vector2d> landmarks;     ///< Initial guess [m], same frame.
  std::vector<BlockObservation> observations;
  /// motion[k]: from member k to member k + 1, if odometry measured it; size members - 1 or 0.
  std::vector<std::optional<geometry::SE2WithCovariance>> motion;
  /// The same steps by the IMU; size members - 1 or 0. For a moving vehicle only the translation of
  /// `motion` is used then, since its rotation is from the same gyro.
  std::vector<std::optional<model::InertialMotion>> inertial;
  BiasEstimate bias;  ///< Prior of the IMU's bias; used with `inertial`.
};

/// The estimate in the frame `centre`.
///
/// Detections and odometry leave the motion of the whole block undetermined. It is fixed by the
/// condition that the members' pose errors sum to zero (inner constraint). In this gauge the
/// correlation of the landmarks' errors is least.
struct BlockEstimate {
  bool converged = false;  ///< Within eight iterations.
  bool determined =
      false;  ///< Each member's motion relative to the others is determined by the measurements.
  std::vector<geometry::SE2WithCovariance> centre_T_member;
  std::vector<Eigen::Vector2d> landmarks;  ///< Frame `centre` [m].
  /// Exact 2 x 2 blocks in that gauge [m^2]; NaN for a landmark without observation. These and the
  /// members' covariances are exactly symmetric and positive semidefinite.
  std::vector<Eigen::Matrix2d> landmark_covariance;
  std::vector<double> chi2;          ///< Per observation, 2 degrees of freedom, after the fit.
  std::optional<BiasEstimate> bias;  ///< Of the IMU, if there is one.
  double inertial_chi2 = 0.0;        ///< Of the IMU's measurements, after the fit.
  int inertial_degrees_of_freedom = 0;
};

/// Gauss-Newton with the landmarks eliminated (Schur complement on the 3n pose parameters). An
/// empty problem gives an empty estimate. Cost O(observations n + n^3) per iteration.
BlockEstimate adjust_block(const BlockProblem& problem);

}  // namespace understory::keyframer::joint
