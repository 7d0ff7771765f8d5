// Reports of the keyframer about its work and its inputs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

namespace understory::keyframer {

/// Counts of scans and keyframes, since the first start (a saved state includes them).
struct KeyframerCounters {
  std::uint64_t scans = 0;               ///< Received.
  std::uint64_t scans_refused = 0;       ///< Not later than the last one.
  std::uint64_t scans_unmatched = 0;     ///< Not used for a keyframe, including refused ones.
  std::uint64_t keyframes = 0;           ///< Published.
  std::uint64_t keyframes_withheld = 0;  ///< Gathered, but not good enough to publish.
  std::string last_reason;               ///< Why the last scan or keyframe was not used.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.scans, self.scans_refused, self.scans_unmatched, self.keyframes, self.keyframes_withheld,
      self.last_reason);
  }
};

/// Difference between the landmarks' motion and that by wheels, with standard deviations.
struct CalibrationError {
  double yaw_rad = 0.0;  ///< Of the landmarks' frame relative to the wheels': mounting.
  double yaw_sigma_rad = 1.0;
  /// Position of the sensor relative to the configured one, ahead and to the left.
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d place_sigma_m = Eigen::Vector2d::Ones();
  /// The same if clock and wheels are correct.
  double mount_yaw_rad = 0.0;
  Eigen::Vector2d mount_place_m = Eigen::Vector2d::Zero();
  /// Significance, in sigmas, with which a wrong mounting or clock of the sensor fits the
  /// translations better than a wrong wheel scale. In an even curve the two cannot be
  /// distinguished.
  double sensor_sigmas = 0.0;
  double scale = 0.0;  ///< Share by which the wheels measure a longer path.
  double scale_sigma = 1.0;
  /// Stamps of scans minus their time by odometry; at constant rate and speed not distinguishable
  /// from a position error.
  double late_s = 0.0;
  double late_sigma_s = 1.0;
  /// Root mean squares of the vehicle's speeds: they convert a lateness to an error of the pose.
  double speed_mps = 0.0;
  double rate_rad_s = 0.0;
  /// Mean square of the difference between the rotations by landmarks and by gyro, divided by its
  /// stated variance. Larger if whole scans are shaken, or if the gyro is worse than stated.
  double turn_chi2 = 1.0;
};

/// Quality of a keyframer's inputs.
struct InputQuality {
  bool is_noise_misstated = false;    ///< LANDMARKS contradict the scans; DetectionNoise adjusts.
  CalibrationError calibration;       ///< Over the last minutes.
  CalibrationError lately;            ///< Over the last ten seconds: recent changes.
  bool contradicts_odometry = false;  ///< The landmarks' last motion contradicts odometry.
};

}  // namespace understory::keyframer
