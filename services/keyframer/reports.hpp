// What the keyframer reports of its work and of its inputs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

namespace understory::keyframer {

/// What became of scans and keyframes, since the first start (a saved state includes it).
struct KeyframerCounters {
  std::uint64_t scans = 0;               ///< Received.
  std::uint64_t scans_refused = 0;       ///< Not later than the last one.
  std::uint64_t scans_unmatched = 0;     ///< Not used for a keyframe, the refused ones included.
  std::uint64_t keyframes = 0;           ///< Given out.
  std::uint64_t keyframes_withheld = 0;  ///< Gathered, but not good enough to give out.
  std::string last_reason;               ///< Why the last scan or keyframe was not used.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.scans, self.scans_refused, self.scans_unmatched, self.keyframes, self.keyframes_withheld,
      self.last_reason);
  }
};

/// How the landmarks' motion differs from that by wheels, with standard deviations.
struct CalibrationError {
  double yaw_rad = 0.0;  ///< The landmarks' frame against the wheels': mounting.
  double yaw_sigma_rad = 1.0;
  /// The sensor beside its configured place, ahead and to the left.
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d place_sigma_m = Eigen::Vector2d::Ones();
  /// The same where clock and wheels are right.
  double mount_yaw_rad = 0.0;
  Eigen::Vector2d mount_place_m = Eigen::Vector2d::Zero();
  /// By how many sigmas another mounting or another clock of the sensor explains the ways better
  /// than another wheel scale does. In an even curve it cannot be told which of the two it is.
  double sensor_sigmas = 0.0;
  double scale = 0.0;  ///< Share by which wheels measure a longer way.
  double scale_sigma = 1.0;
  /// Stamps of scans after the time at which odometry says that they were made; where rate and
  /// speed are constant it cannot be told from the place.
  double late_s = 0.0;
  double late_sigma_s = 1.0;
  /// Root mean squares of how the vehicle moved: what such a lateness does to a pose.
  double speed_mps = 0.0;
  double rate_rad_s = 0.0;
  /// Mean square of the difference of the turns by landmarks and by gyro, by its variance as
  /// stated. Larger where scans are shaken as a whole, or where the gyro is worse than stated.
  double turn_chi2 = 1.0;
};

/// What a keyframer says of its inputs.
struct InputQuality {
  bool is_noise_misstated = false;    ///< LANDMARKS contradict the scans; DetectionNoise adjusts.
  CalibrationError calibration;       ///< By the last minutes.
  CalibrationError lately;            ///< By the last ten seconds: what has just changed.
  bool contradicts_odometry = false;  ///< The landmarks' last motion is not odometry's.
};

}  // namespace understory::keyframer
