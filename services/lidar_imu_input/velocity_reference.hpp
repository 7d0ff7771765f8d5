// Velocity from GNSS in the frame `odom`: only for a reference.
#pragma once

#include <optional>

#include "common/model/gnss.hpp"

namespace understory::lidar_imu_input {

/// What a fix says about the vehicle, given that it moves where it points.
struct ReferenceVelocity {
  Eigen::Vector2d odom_velocity_mps = Eigen::Vector2d::Zero();
  double sigma_mps = 0.0;
  std::optional<double> heading_rad;  ///< In odom; none while too slow to tell.
  double heading_sigma_rad = 0.0;
};

class VelocityReference {
 public:
  /// `heading_rad`: of the vehicle in odom at the fix. None before the first velocity that is fast
  /// enough to tell how odom lies to east and north. Fixes without velocity are differenced.
  std::optional<ReferenceVelocity> add(const model::GnssFix& fix, double heading_rad);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.previous_, self.east_to_odom_rad_, self.east_to_odom_variance_);
  }

 private:
  std::optional<model::GnssFix> previous_;
  std::optional<double> east_to_odom_rad_;  ///< How odom lies; grows more certain fix by fix.
  double east_to_odom_variance_ = 0.0;
};

}  // namespace understory::lidar_imu_input
