// What every method of making keyframes has in common.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"

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

/// Local bundle adjustment (GeoSLAM §4.2, algorithm 2): n scans become one keyframe.
///
/// All inputs come in order of time; what a method cannot use is counted, never thrown.
class KeyframerMethod {
 public:
  virtual ~KeyframerMethod() = default;

  /// Takes one scan. Returns the keyframe that the scan completes, if any.
  virtual std::optional<model::Keyframe> add(const model::LandmarkScan& scan) = 0;
  /// Keyframes of the first scans that waited for what the last scan shows; they come before the
  /// one that add() returned. None by default. Ask after each scan.
  virtual std::vector<model::Keyframe> take_waited() { return {}; }
  /// Motion of the vehicle by wheels or IMU, where there is any. It must come before the scan at
  /// its end. It predicts the next scan and bridges scans with few landmarks.
  virtual void add(const model::Odometry& odometry) = 0;
  /// The error of roll and pitch as the filter estimates it: scans that come later are corrected by
  /// it. Ignored by default.
  virtual void add(const model::EkfLevel& /*level*/) {}

  /// What the scans say of themselves and of odometry; nothing by default.
  virtual InputQuality input_quality() const { return {}; }

  /// Counts for HEALTH.
  virtual const KeyframerCounters& counters() const = 0;

  /// The whole state as bytes, for a restart.
  virtual std::string save() const = 0;
  /// Takes what save() of the same method gave. Throws std::invalid_argument on other bytes; the
  /// state is then as before.
  virtual void load(const std::string& bytes) = 0;
};

}  // namespace understory::keyframer
