// How the vehicle moves by the filter's word: for sweeps of a laser that has no other sensor beside
// it.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "services/lidar_imu_input/motion_history.hpp"

namespace understory::lidar_imu_input {

/// The filter's latest poses, taken as one even motion (constant twist, as in KISS-ICP, Vizzo et
/// al. 2023). A landmark that is passed is seen at all times of the turn: without this it seems to
/// move by a tenth of a second's way, forward on one side and backward on the other, which turns
/// the map.
class FilterMotion {
 public:
  void add(const model::EkfPose& pose);
  /// Motion at `stamp`, from which at() of a history goes back over the turn. None where the filter
  /// did not speak within kLongest_s before, or began anew since.
  std::optional<MotionState> at(model::Utime stamp) const;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_, self.reset_counter_);
  }

  static constexpr double kBaseline_s = 0.3;  ///< Evens out the poses' noise.
  static constexpr double kLongest_s = 1.0;

 private:
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

  std::deque<Pose> poses_;
  std::uint64_t reset_counter_ = 0;
};

}  // namespace understory::lidar_imu_input
