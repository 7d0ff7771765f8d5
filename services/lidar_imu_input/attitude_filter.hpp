// Roll and pitch of a moving vehicle from its IMU, aided by wheels and standstills.
//
// Only the accelerometer measures gravity, but it also measures the vehicle's acceleration. So the
// state contains the velocity u, in the frame of the vehicle:
//   du/dt = f - b_a - (w - b_g) x u + R^T g
// If wheels (or a standstill) measure u, the rest of f is gravity: acceleration and centripetal
// force are compensated as accurately as u is known. Landmarks are not used.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Gravity of the Earth, as measured by the accelerometer of a level vehicle at rest.
constexpr double kGravity_mps2 = 9.81;

/// Angles of a rotation Rz(yaw) Ry(pitch) Rx(roll).
struct RollPitchYaw {
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;
};
/// The angles of a unit quaternion; pitch in [-pi / 2, pi / 2].
RollPitchYaw roll_pitch_yaw(const Eigen::Quaterniond& rotation);

/// A velocity in `vehicle_level` [m/s].
struct LevelVelocity {
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2ps2 = Eigen::Matrix2d::Zero();
};

/// Level error (roll, pitch) at the last standstill, estimated from all later measurements: a
/// fixed-point smoother (Anderson & Moore 1979, section 7.2).
struct RestTilt {
  /// Error of the estimate at that time, in the sense of model::LevelError [rad].
  Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Of the remaining error [rad^2].
  double yaw_rad = 0.0;                                  ///< Yaw of the level at that time.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.error_rad, s.covariance, s.yaw_rad);
  }
};

/// Error state filter; errors: attitude (right perturbation), velocity, gyro and force bias, scale
/// of the wheels' speed (otherwise taken for tilt when the vehicle accelerates or turns). Frame
/// vehicle throughout. Cost: one 13 x 13 product per propagation.
class AttitudeFilter {
 public:
  /// Of (attitude [rad], velocity [m/s], gyro bias [rad/s], force bias [m/s^2], wheel scale).
  using Covariance = Eigen::Matrix<double, 13, 13>;

  /// Starts from one sample: tilt from the force, velocity unknown.
  AttitudeFilter(const ImuParameters& imu, const Eigen::Vector3d& specific_force_mps2);

  /// Rate [rad/s] and specific force [m/s^2] (frame vehicle, at its origin) over `seconds`.
  /// `saturated`: with the noise of omitted samples.
  void propagate(const Eigen::Vector3d& rate, const Eigen::Vector3d& force, double seconds,
                 bool saturated);
  /// Propagates over `seconds` without samples: the uncertainty of tilt and velocity grows.
  void bridge(double seconds);

  /// Updates with a velocity component: `residual_mps` = measured - predicted value of
  /// direction . (u + w x at); `direction` unit, `at` [m].
  void add_velocity(const Eigen::Vector3d& direction, const Eigen::Vector3d& at,
                    double residual_mps, double sigma_mps);
  /// Updates with the velocity across the floor at `at` [m]. The body pitches on its springs, and
  /// this velocity with it: the correlation of the two would change the forward speed. So the speed
  /// along `forward` and the wheels' scale stay unchanged, and their errors are included (a
  /// Schmidt-Kalman update; docs/decisions/170).
  void add_velocity_off_ground(const Eigen::Vector3d& forward, const Eigen::Vector3d& at,
                               double residual_mps, double sigma_mps);
  /// Updates with the speed along `forward` at `at` [m]: predicted without the wheels' scale, and
  /// measured by the wheels.
  void add_wheel_speed(const Eigen::Vector3d& forward, const Eigen::Vector3d& at,
                       double predicted_mps, double measured_mps, double sigma_mps);
  /// Velocity and true rate are zero: the gyro (`rate` [rad/s]) measures its bias. `seconds`: since
  /// the previous sample.
  void add_standstill(const Eigen::Vector3d& rate, double seconds, double velocity_sigma_mps);

  /// Vehicle to level: Ry(pitch) Rx(roll).
  Eigen::Quaterniond level_Q_vehicle() const;
  /// Of (roll, pitch) [rad^2].
  Eigen::Matrix2d tilt_covariance() const;
  /// Propagation of the level error (roll, pitch) since the last mark_level(): its covariance, and
  /// its correlation with the error at the mark.
  model::LevelError level_since_mark() const;
  /// Stores the present level error for level_since_mark().
  void mark_level();
  /// Present estimate of the level at the last add_standstill().
  const RestTilt& rest() const { return rest_; }
  /// Covariance of that error minus the present error, by the present estimates of both, about the
  /// axes of that time [rad^2]. Zero at the standstill: the unobservable part displaces earlier and
  /// present landmarks alike.
  Eigen::Matrix2d tilt_change_covariance() const;
  /// Rotation of the level's heading by corrections of roll and pitch since the last mark [rad]:
  /// nonzero on a slope. Levelled data rotate by the same angle.
  double twist_since_mark_rad() const { return twist_rad_; }
  const Eigen::Vector3d& velocity() const { return velocity_; }  ///< Frame vehicle.
  /// velocity() in the level frame: forward and left, with its covariance [m/s].
  LevelVelocity level_velocity() const;
  /// Of velocity() [m^2/s^2].
  Eigen::Matrix3d velocity_covariance() const { return covariance_.block<3, 3>(3, 3); }
  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }  ///< [rad/s]
  double wheel_scale() const { return wheel_scale_; }  ///< Measured divided by true speed.
  /// Of wheel_scale().
  double wheel_scale_sigma() const { return std::sqrt(covariance_(12, 12)); }
  /// Of gyro_bias() [rad^2/s^2].
  Eigen::Matrix3d gyro_bias_covariance() const { return covariance_.block<3, 3>(6, 6); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.world_Q_vehicle_, self.velocity_, self.gyro_bias_, self.force_bias_, self.wheel_scale_,
      self.covariance_, self.with_mark_, self.marked_, self.twist_rad_, self.with_rest_,
      self.rest_);
  }

 private:
  using Row = Eigen::Matrix<double, 1, 13>;
  /// The optimal gain is multiplied by `kept`.
  void update(const Row& row, double residual, double variance,
              const Covariance& kept = Covariance::Identity());
  void mark_rest();

  ImuParameters imu_;
  Eigen::Quaterniond world_Q_vehicle_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_bias_ = Eigen::Vector3d::Zero();
  double wheel_scale_ = 1.0;  ///< Measured divided by true speed.
  Covariance covariance_ = Covariance::Zero();
  /// Covariance of the error with the level error at the last mark, and that of the latter.
  Eigen::Matrix<double, 13, 2> with_mark_ = Eigen::Matrix<double, 13, 2>::Zero();
  Eigen::Matrix2d marked_ = Eigen::Matrix2d::Zero();
  double twist_rad_ = 0.0;
  /// Covariance of the error with the level error at the last standstill, and that of the latter.
  Eigen::Matrix<double, 13, 2> with_rest_ = Eigen::Matrix<double, 13, 2>::Zero();
  RestTilt rest_;
};

}  // namespace understory::lidar_imu_input
