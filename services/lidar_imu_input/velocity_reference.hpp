// Velocity from GNSS in the frame `odom`, as a reference.
#pragma once

#include <optional>

#include "common/model/gnss.hpp"

namespace understory::lidar_imu_input {

/// Measurements of a fix, for a vehicle that drives in the direction of its heading.
struct ReferenceVelocity {
  Eigen::Vector2d odom_velocity_mps = Eigen::Vector2d::Zero();
  double sigma_mps = 0.0;
  std::optional<double> heading_rad;  ///< In odom; none below 2 m/s.
  double heading_sigma_rad = 0.0;
};

/// Estimates the rotation between east/north and `odom` from fixes of a moving vehicle.
class VelocityReference {
 public:
  /// `heading_rad`: of the vehicle in odom at the fix. None before the first velocity that is fast
  /// enough to determine the rotation between east/north and odom. Fixes without velocity are
  /// differenced if they are at most 3 s apart.
  std::optional<ReferenceVelocity> add(const model::GnssFix& fix, double heading_rad);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.previous_, self.east_to_odom_rad_, self.east_to_odom_variance_);
  }

 private:
  std::optional<model::GnssFix> previous_;
  std::optional<double> east_to_odom_rad_;  ///< Its uncertainty decreases with every fix.
  double east_to_odom_variance_ = 0.0;      ///< [rad^2]
};

}  // namespace understory::lidar_imu_input
