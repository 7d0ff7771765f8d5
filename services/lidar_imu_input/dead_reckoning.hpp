// RAW_POSE: strapdown integration in the plane, velocity corrected from outside.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Pose (in `odom`), velocity (in `vehicle_level`) and biases from levelled samples. The pose
/// drifts and never jumps: measurements move velocity and biases only; that pose errors are
/// correlated with them is kept in the covariance.
class DeadReckoning {
 public:
  /// Of pose (right perturbation, tangent order), velocity, bias.
  using Covariance = Eigen::Matrix<double, 8, 8>;

  explicit DeadReckoning(const ImuParameters& imu);

  /// From sample a to sample b, trapezoidal rule.
  void propagate(const LevelSample& a, const LevelSample& b);
  /// Motion over a time that no sample covers.
  void bridge(const geometry::SE2WithCovariance& motion);
  /// direction . (velocity + yaw rate x at) differs from what was measured by `residual`.
  void add_velocity(const Eigen::Vector2d& direction, const Eigen::Vector2d& at,
                    double residual_mps, double sigma_mps);
  /// Velocity is zero; the gyro bias comes from elsewhere.
  void add_standstill(double velocity_sigma_mps);
  /// The heading is off by `residual` (GNSS aided only: the heading jumps).
  void add_heading(double residual_rad, double sigma_rad);
  void set_gyro_bias(double bias_rad_s, double sigma_rad_s);
  /// Velocity and biases become the filter's. `then_velocity`, `then_heading`: what was thought at
  /// the correction's stamp; the difference is carried to now.
  void correct(const model::VelocityCorrection& correction, const Eigen::Vector2d& then_velocity,
               double then_heading);

  const geometry::SE2& pose() const { return pose_; }
  Eigen::Matrix3d pose_covariance() const { return covariance_.topLeftCorner<3, 3>(); }
  const Eigen::Vector2d& velocity() const { return velocity_; }
  Eigen::Matrix2d velocity_covariance() const { return covariance_.block<2, 2>(3, 3); }
  const model::InertialBias& bias() const { return bias_; }

  void set_pose(const geometry::SE2& pose) { pose_ = pose; }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.pose_, self.velocity_, self.bias_, self.covariance_);
  }

 private:
  using Row = Eigen::Matrix<double, 1, 8>;
  void update(const Row& row, double residual, double variance, bool moves_heading);

  ImuParameters imu_;
  geometry::SE2 pose_;
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  model::InertialBias bias_ = model::InertialBias::Zero();
  Covariance covariance_ = Covariance::Zero();
};

}  // namespace understory::lidar_imu_input
