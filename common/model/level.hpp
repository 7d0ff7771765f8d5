// Detections at the true level, by the filter's estimate of the error of roll and pitch.
#pragma once

#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"

namespace understory::model {

/// Landmarks are given at breast height [m]; an error of the level displaces them by it.
inline constexpr double kLandmarkHeight_m = 1.3;
/// What an error of (roll, pitch) displaces at this height: d(position) / d(roll, pitch) [m/rad].
Eigen::Matrix2d level_arm(double height_m);

/// The filter's latest estimate of the level's error, for stages that take LANDMARKS.
class LevelCorrection {
 public:
  /// Replaces the estimate.
  void set(const EkfLevel& level) { level_ = level; }
  /// The scan at the true level: an error of roll and pitch displaces detections in proportion to
  /// their height. The part of this error in their covariances is replaced by that of the remaining
  /// error. The scan comes back as it is where the estimate is older than 2 s, or there is none.
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

/// Roll and pitch of a vehicle that no IMU measures: how fast they leave what was last known [rad
/// per square root of a second], and how far [rad] (docs/decisions/149).
inline constexpr double kTiltWalk = 0.03;
inline constexpr double kMostTilt_rad = 0.03;

/// How far they really go on uneven ground [rad]: 50 mrad in 3 s, 75 in 30 s. Detections state
/// less, since the heading, which a constant level does not touch, would be let go with them.
inline constexpr double kMostTiltOfPoses_rad = 0.07;

/// Covariance of (roll, pitch) [rad^2] when no IMU has measured them for `seconds` more.
Eigen::Matrix2d level_without_imu(const Eigen::Matrix2d& covariance_rad2, double seconds,
                                  double most_rad = kMostTilt_rad);

/// How well the sweeps of now are levelled, by ODOMETRY. All landmarks of a sweep that no IMU has
/// levelled are displaced alike, and each states that for itself: with twenty of them a pose states
/// a centimetre of the four that it is off. What they have in common is added where a pose is
/// given out (docs/decisions/151).
class SweepLevel {
 public:
  /// The next increment.
  void add(const Odometry& odometry);
  /// What an error of the level that sweeps have now, and those before had not, adds to the
  /// covariance of a pose among landmarks (right perturbation). Zero where the level was never
  /// measured, and while it is known about as well as it has been: such an error displaces all
  /// sweeps alike, or is known to who gives the pose.
  Eigen::Matrix3d pose_covariance() const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.covariance_rad2_, self.least_rad2_);
  }

 private:
  std::optional<Eigen::Matrix2d> covariance_rad2_;  ///< Of (roll, pitch); none before an IMU.
  double least_rad2_ = 0.0;                         ///< Least trace of it so far.
};

/// A detection's covariance [m^2] in the plane without the part by an error of the level; at least
/// 5 % remains in each direction. `arm` [m/rad]: d(position) / d(roll, pitch).
Eigen::Matrix2d without_level(const Eigen::Matrix2d& covariance_m2, const Eigen::Matrix2d& arm,
                              const Eigen::Matrix2d& level_covariance_rad2);

}  // namespace understory::model
