// Velocity from GNSS in the frame `odom`, for a reference.
#pragma once

#include <optional>

#include "common/model/gnss.hpp"

namespace understory::lidar_imu_input {

/// What a fix measures of the vehicle, if that drives in the direction of its heading.
struct ReferenceVelocity {
  Eigen::Vector2d odom_velocity_mps = Eigen::Vector2d::Zero();
  double sigma_mps = 0.0;
  std::optional<double> heading_rad;  ///< In odom; none below 2 m/s.
  double heading_sigma_rad = 0.0;
};

/// Learns the rotation between east/north and `odom` from fixes of a moving vehicle.
class VelocityReference {
 public:
  /// `heading_rad`: of the vehicle in odom at the fix. None before the first velocity that is fast
  /// enough to show the rotation between east/north and odom. Fixes without velocity are
  /// differenced, where they are at most 3 s apart.
  std::optional<ReferenceVelocity> add(const model::GnssFix& fix, double heading_rad);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.previous_, self.east_to_odom_rad_, self.east_to_odom_variance_);
  }

 private:
  std::optional<model::GnssFix> previous_;
  std::optional<double> east_to_odom_rad_;  ///< Grows more certain with every fix.
  double east_to_odom_variance_ = 0.0;      ///< [rad^2]
};

}  // namespace understory::lidar_imu_input
