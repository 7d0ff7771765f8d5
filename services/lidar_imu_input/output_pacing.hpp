// When RAW_POSE goes out, and when a missing calibration is reported.
#pragma once

#include <optional>

#include "services/lidar_imu_input/input_fault.hpp"
#include "services/lidar_imu_input/motion_estimator.hpp"

namespace understory::lidar_imu_input {

/// Lets poses through that are new, at most one per period. Invariant: their stamps advance.
class RawPosePacer {
 public:
  /// `period_s`: `OutputParameters::raw_pose_period_s`.
  explicit RawPosePacer(double period_s);

  /// The pose where it is due. `at_once`: without waiting for the period, as at the end of an
  /// increment of odometry.
  std::optional<model::RawPose> take(const model::RawPose& pose, bool at_once);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.last_utime_);
  }

 private:
  model::Utime period_us_;
  std::optional<model::Utime> last_utime_;
};

/// Reports once that the vehicle moves although it was never stationary long enough to calibrate.
class CalibrationWatch {
 public:
  /// `imu_is_live`: the IMU has not gone silent. None where there is nothing new to report.
  std::optional<InputFault> check(const MotionEstimator& motion, bool imu_is_live);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.is_reported_);
  }

 private:
  bool is_reported_ = false;
};

}  // namespace understory::lidar_imu_input
