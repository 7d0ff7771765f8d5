// Pacing of RAW_POSE, and the report of a missing calibration.
#pragma once

#include <optional>

#include "services/lidar_imu_input/input_fault.hpp"
#include "services/lidar_imu_input/motion_estimator.hpp"

namespace understory::lidar_imu_input {

/// Passes new poses, at most one per period. Invariant: their stamps advance.
class RawPosePacer {
 public:
  /// `period_s`: `OutputParameters::raw_pose_period_s`.
  explicit RawPosePacer(double period_s);

  /// The pose if it is due. `at_once`: ignoring the period, as at the end of an increment of
  /// odometry.
  std::optional<model::RawPose> take(const model::RawPose& pose, bool at_once);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.last_utime_);
  }

 private:
  model::Utime period_us_;
  std::optional<model::Utime> last_utime_;
};

/// Reports once that the vehicle moves before a standstill long enough for calibration.
class CalibrationWatch {
 public:
  /// `imu_is_live`: the IMU is not silent. None without a new report.
  std::optional<InputFault> check(const MotionEstimator& motion, bool imu_is_live);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.is_reported_);
  }

 private:
  bool is_reported_ = false;
};

}  // namespace understory::lidar_imu_input
