// Corrects detections by the filter's estimate of the error of roll and pitch.
#pragma once

#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"

namespace understory::model {

/// Landmarks are given at breast height [m]; an error of the level displaces them in proportion to
/// it.
inline constexpr double kLandmarkHeight_m = 1.3;
/// Displacement at this height by an error of (roll, pitch): d(position) / d(roll, pitch) [m/rad].
Eigen::Matrix2d level_arm(double height_m);

/// The filter's latest estimate of the level's error, for stages that use LANDMARKS.
class LevelCorrection {
 public:
  /// Replaces the estimate.
  void set(const EkfLevel& level) { level_ = level; }
  /// Corrects a scan to the true level: an error of roll and pitch displaces detections in
  /// proportion to their height. The part of this error in their covariances is replaced by the
  /// remaining error. The scan is returned unchanged where the estimate is older than 2 s or
  /// missing.
  LandmarkScan levelled(LandmarkScan scan) const;
  /// The estimate; none at the start.
  const std::optional<EkfLevel>& latest() const { return level_; }
  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.level_);
  }

 private:
  std::optional<EkfLevel> level_;
};

/// Random walk of roll and pitch without an IMU, from the last known values [rad per square root of
/// a second], and its largest sigma [rad] (docs/decisions/149).
inline constexpr double kTiltWalk = 0.03;
inline constexpr double kMostTilt_rad = 0.03;

/// The same largest sigma for poses [rad]: on uneven ground roll and pitch change by 50 mrad in 3
/// s, by 75 mrad in 30 s. Detections state less, otherwise they would no longer determine the
/// heading, which a constant level error does not affect.
inline constexpr double kMostTiltOfPoses_rad = 0.07;

/// Covariance of (roll, pitch) [rad^2] when no IMU has measured them for `seconds` more.
Eigen::Matrix2d level_without_imu(const Eigen::Matrix2d& covariance_rad2, double seconds,
                                  double most_rad = kMostTilt_rad);

/// Accuracy of the present sweeps' level, from ODOMETRY. Without an IMU all landmarks of a sweep
/// are displaced alike, but each states this as its own error: with twenty landmarks, a pose states
/// 1 cm instead of 4 cm. The common part is added to the covariance of published poses
/// (docs/decisions/151).
class SweepLevel {
 public:
  /// Adds the next increment.
  void add(const Odometry& odometry);
  /// Additional covariance of a pose among landmarks (right perturbation), from a level error that
  /// earlier sweeps did not have. Zero where the level was never measured, and while it is about as
  /// accurate as before: such an error displaces all sweeps alike, or the pose's source includes
  /// it.
  Eigen::Matrix3d pose_covariance() const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.covariance_rad2_, self.least_rad2_);
  }

 private:
  std::optional<Eigen::Matrix2d>
      covariance_rad2_;      ///< Covariance of (roll, pitch); none before an IMU.
  double least_rad2_ = 0.0;  ///< Least trace of it so far.
};

/// A detection's covariance [m^2] in the plane without the part from an error of the level; at
/// least 5 % remains in each direction. `arm` [m/rad]: d(position) / d(roll, pitch).
Eigen::Matrix2d without_level(const Eigen::Matrix2d& covariance_m2, const Eigen::Matrix2d& arm,
                              const Eigen::Matrix2d& level_covariance_rad2);

}  // namespace understory::model
