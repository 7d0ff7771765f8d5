// Motion of the vehicle from the filter's poses: for sweeps of a laser without any motion sensor.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "services/lidar_imu_input/motion_history.hpp"

namespace understory::lidar_imu_input {

/// Motion at constant twist through the filter's latest poses (as in KISS-ICP, Vizzo et al. 2023).
/// A landmark can be measured at any time of the revolution: without this motion it is displaced by
/// the distance driven in 0.1 s, forward on one side and backward on the other, which rotates the
/// map.
class FilterMotion {
 public:
  /// Adds EKF_POSE. Ignored if it is not finite or the filter used fewer than 3 landmarks: then it
  /// only predicts. After a reset, a step back in time or a gap, earlier poses are dropped.
  void add(const model::EkfPose& pose);
  /// Motion at `stamp`; at() of a history extrapolates it back over the revolution. None if there
  /// is no pose within kLongest_s before, or the poses cover less than half of kBaseline_s.
  std::optional<MotionState> at(model::Utime stamp) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_, self.reset_counter_);
  }

  static constexpr double kBaseline_s = 0.3;  ///< Averages the poses' noise.
  static constexpr double kLongest_s = 1.0;  ///< Poses at a larger distance in time are not joined.

 private:
  /// ekf_map_T_vehicle.
  struct Pose {
    model::Utime utime = 0;
    double x_m = 0.0;
    double y_m = 0.0;
    double heading_rad = 0.0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.utime, self.x_m, self.y_m, self.heading_rad);
    }
  };

  std::deque<Pose> poses_;  ///< Of the last kBaseline_s.
  std::uint64_t reset_counter_ = 0;
};

}  // namespace understory::lidar_imu_input
