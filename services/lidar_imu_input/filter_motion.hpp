// How the vehicle moves by the filter's poses: for sweeps of a laser without any other sensor.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "services/lidar_imu_input/motion_history.hpp"

namespace understory::lidar_imu_input {

/// The filter's latest poses, taken as one even motion (constant twist, as in KISS-ICP, Vizzo et
/// al. 2023). A landmark is measured at any time of the revolution: without this it seems to move
/// by the distance driven in a tenth of a second, forward on one side and backward on the other,
/// which rotates the map.
class FilterMotion {
 public:
  /// Takes EKF_POSE. Ignored where it is not finite or the filter used fewer than 3 landmarks: then
  /// it only predicts. After a reset, a step back in time or a gap the poses before are forgotten.
  void add(const model::EkfPose& pose);
  /// Motion at `stamp`, from which at() of a history goes back over the revolution. None where no
  /// pose came within kLongest_s before, or the poses cover less than half of kBaseline_s.
  std::optional<MotionState> at(model::Utime stamp) const;

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_, self.reset_counter_);
  }

  static constexpr double kBaseline_s = 0.3;  ///< Averages the poses' noise.
  static constexpr double kLongest_s = 1.0;   ///< Poses farther apart are not joined.

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
