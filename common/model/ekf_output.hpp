// Output of the filter and of dead reckoning.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"

namespace understory::model {

/// Channel RAW_POSE: dead reckoning. Drifts, never jumps.
struct RawPose {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  geometry::SE2 odom_T_vehicle;                          ///< Starts with the identity.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Right perturbation; m, rad.
  bool is_reference = false;  ///< Aided by GNSS: for evaluation, never for mapping.
};

/// Channel EKF_POSE: the filter's state after one scan. Its pose is used for gating and
/// linearisation, never as a measurement.
struct EkfPose {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  geometry::SE2 ekf_map_T_vehicle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();           ///< Right perturbation; m, rad.
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();         ///< Frame `vehicle_level`.
  Eigen::Matrix2d velocity_covariance = Eigen::Matrix2d::Zero();  ///< [(m/s)^2]
  InertialBias bias = InertialBias::Zero();
  Eigen::Matrix3d bias_covariance = Eigen::Matrix3d::Zero();  ///< In the order and units of `bias`.
  std::uint32_t landmarks_used = 0;  ///< Landmarks used in the latest update.
  /// Landmarks refused by the chi^2 tests in the latest update.
  std::uint32_t landmarks_refused = 0;
  std::uint64_t reset_counter = 0;  ///< Counts restarts of the filter: the pose jumped.
};

/// One landmark of the filter's active state.
struct EkfLandmark {
  TrackId track_id = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();     ///< Frame `ekf_map`.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< Covariance, frame `ekf_map`.
  double radius_m = 0.0;                                    ///< 0 where unknown.
  LandmarkKind kind = LandmarkKind::kTrunk;
  std::uint32_t observation_count = 0;  ///< Scans that updated it.
};

/// Channel EKF_MAP: the landmarks of the active state.
struct EkfMap {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  std::vector<EkfLandmark> landmarks;  ///< In order of track id.
};

/// Channel EKF_LEVEL: error of the attitude that levels sweeps, about the axes of `vehicle_level`.
struct EkfLevel {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();   ///< Roll, pitch; the filter's estimate.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Covariance of the estimate [rad^2].
  /// Covariance of the whole error [rad^2], as included in the covariances of detections.
  Eigen::Matrix2d reported_covariance = Eigen::Matrix2d::Zero();
};

/// Channel VELOCITY_CORRECTION: the filter's estimate of velocity and biases at utime.
struct VelocityCorrection {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level`.
  InertialBias bias = InertialBias::Zero();
  /// Covariance of (velocity, bias), in their units squared.
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
};

}  // namespace understory::model
