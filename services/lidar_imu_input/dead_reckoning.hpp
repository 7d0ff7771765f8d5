// RAW_POSE: strapdown integration in the plane, with external velocity corrections.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Pose (in `odom`), velocity (in `vehicle_level`) and biases from levelled samples. The pose
/// drifts and never jumps: measurements change only velocity and biases; the correlation of pose
/// errors with them is kept in the covariance.
class DeadReckoning {
 public:
  /// Of pose (right perturbation, tangent order), velocity [m/s], bias (order of InertialBias).
  using Covariance = Eigen::Matrix<double, 8, 8>;

  /// Starts at the origin of `odom` with unknown velocity and the biases' prior.
  explicit DeadReckoning(const ImuParameters& imu);

  /// From sample a to sample b, trapezoidal rule.
  void propagate(const LevelSample& a, const LevelSample& b);
  /// Likewise for a time over which the pose was moved already: only velocity and biases.
  void propagate_velocity(const LevelSample& a, const LevelSample& b);
  /// Applies a motion over a time without samples, in frame `vehicle_level`.
  void bridge(const geometry::SE2WithCovariance& motion);
  /// Sets the velocity, independent of all other errors.
  void set_velocity(const LevelVelocity& velocity);
  /// Updates with a velocity component: `residual_mps` = measured - predicted value of
  /// direction . (velocity + yaw rate x at); `direction` unit, `at` [m].
  void add_velocity(const Eigen::Vector2d& direction, const Eigen::Vector2d& at,
                    double residual_mps, double sigma_mps);
  /// Zero velocity; set_gyro_bias() gives the gyro's bias.
  void add_standstill(double velocity_sigma_mps);
  /// Updates with a heading: `residual_rad` = measured - predicted (GNSS aided only: the heading
  /// jumps).
  void add_heading(double residual_rad, double sigma_rad);
  /// Sets the bias of the yaw rate, independent of all other errors.
  void set_gyro_bias(double bias_rad_s, double sigma_rad_s);
  /// Sets velocity and biases to the filter's. `then_velocity` [m/s], `then_heading` [rad]: the
  /// dead reckoning's own at the correction's stamp; the difference is applied at the present time.
  void correct(const model::VelocityCorrection& correction, const Eigen::Vector2d& then_velocity,
               double then_heading);

  const geometry::SE2& pose() const { return pose_; }  ///< odom_T_vehicle.
  /// Of pose(): tangent order, right perturbation.
  Eigen::Matrix3d pose_covariance() const { return covariance_.topLeftCorner<3, 3>(); }
  const Eigen::Vector2d& velocity() const { return velocity_; }  ///< Frame vehicle_level [m/s].
  /// Of velocity() [m^2/s^2].
  Eigen::Matrix2d velocity_covariance() const { return covariance_.block<2, 2>(3, 3); }
  /// Of yaw rate [rad/s] and force along level x, y [m/s^2].
  const model::InertialBias& bias() const { return bias_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.pose_, self.velocity_, self.bias_, self.covariance_);
  }

 private:
  using Row = Eigen::Matrix<double, 1, 8>;
  void update(const Row& row, double residual, double variance, bool moves_heading);
  /// Sets the pose's covariance, and its correlation with velocity and biases to zero.
  void set_pose_covariance(const Eigen::Matrix3d& covariance);

  ImuParameters imu_;
  geometry::SE2 pose_;  ///< odom_T_vehicle.
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  model::InertialBias bias_ = model::InertialBias::Zero();
  Covariance covariance_ = Covariance::Zero();
};

}  // namespace understory::lidar_imu_input
