// Roll and pitch of a moving vehicle from its IMU, helped by the wheels and by standstills.
//
// Gravity is measured by the accelerometer alone, which also feels the vehicle's acceleration. So
// the filter has the velocity u, in the frame of the vehicle, in its state:
//   du/dt = f - b_a - (w - b_g) x u + R^T g
// Where wheels (or a standstill) measure u, what remains of f is gravity: acceleration and
// centripetal force are compensated to the degree that u is known. No landmark enters.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Of the Earth, as the accelerometer of a level vehicle at rest measures it.
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

/// The error of (roll, pitch) at the last standstill, as all since has shown it: a fixed-point
/// smoother (Anderson & Moore 1979, section 7.2).
struct RestTilt {
  /// By how much the estimate of then was off, in the sense of model::LevelError [rad].
  Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Of it [rad^2].
  double yaw_rad = 0.0;                                  ///< Of the level then.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.error_rad, s.covariance, s.yaw_rad);
  }
};

/// Error state filter; errors: attitude (right perturbation), velocity, gyro and force bias, scale
/// of the wheels' speed (which would pass for tilt whenever the vehicle accelerates or turns).
/// Frame vehicle throughout. Cost: one 13 x 13 product per propagation.
class AttitudeFilter {
 public:
  /// Of (attitude [rad], velocity [m/s], gyro bias [rad/s], force bias [m/s^2], wheel scale).
  using Covariance = Eigen::Matrix<double, 13, 13>;

  /// Starts from one sample: tilt from the force, velocity unknown.
  AttitudeFilter(const ImuParameters& imu, const Eigen::Vector3d& specific_force_mps2);

  /// Rate [rad/s] and specific force [m/s^2] (frame vehicle, at its origin) over `seconds`.
  /// `saturated`: with the noise of left-out samples.
  void propagate(const Eigen::Vector3d& rate, const Eigen::Vector3d& force, double seconds,
                 bool saturated);
  /// `seconds` pass that no sample covers: tilt and velocity become less certain.
  void bridge(double seconds);

  /// Updates with a velocity component: `residual_mps` = measured - predicted value of
  /// direction . (u + w x at); `direction` unit, `at` [m].
  void add_velocity(const Eigen::Vector3d& direction, const Eigen::Vector3d& at,
                    double residual_mps, double sigma_mps);
  /// Updates with the velocity across the floor at `at` [m]. The body pitches on its springs, and
  /// this velocity with it: where both go together the forward speed seems to be another one. So
  /// the speed along `forward` and the wheels' scale are left as they are, and their errors counted
  /// (a filter of Schmidt's kind; docs/decisions/170).
  void add_velocity_off_ground(const Eigen::Vector3d& forward, const Eigen::Vector3d& at,
                               double residual_mps, double sigma_mps);
  /// Updates with the speed along `forward` at `at` [m]: predicted without the wheels' scale, and
  /// as the wheels measured it.
  void add_wheel_speed(const Eigen::Vector3d& forward, const Eigen::Vector3d& at,
                       double predicted_mps, double measured_mps, double sigma_mps);
  /// Velocity and true rate are zero: the gyro (`rate` [rad/s]) shows its bias. `seconds`: since
  /// the sample before.
  void add_standstill(const Eigen::Vector3d& rate, double seconds, double velocity_sigma_mps);

  /// Vehicle to level: Ry(pitch) Rx(roll).
  Eigen::Quaterniond level_Q_vehicle() const;
  /// Of (roll, pitch) [rad^2].
  Eigen::Matrix2d tilt_covariance() const;
  /// How the error of (roll, pitch) goes on from the last mark_level(): its covariance, and what it
  /// has in common with the error then.
  model::LevelError level_since_mark() const;
  /// Remembers the level's error of now for level_since_mark().
  void mark_level();
  /// What is known now of the level at the last add_standstill().
  const RestTilt& rest() const { return rest_; }
  /// Covariance of that error less the error of now, both as known now and about the axes of then
  /// [rad^2]. Zero at the standstill: what neither shows displaces landmarks of then and of now
  /// alike.
  Eigen::Matrix2d tilt_change_covariance() const;
  /// By how much corrections of roll and pitch have rotated the heading of the level since the last
  /// mark [rad]: on a slope they do. What is levelled by it rotates alike.
  double twist_since_mark_rad() const { return twist_rad_; }
  const Eigen::Vector3d& velocity() const { return velocity_; }  ///< Frame vehicle.
  /// velocity() in the level frame: forward and left, with its covariance [m/s].
  LevelVelocity level_velocity() const;
  /// Of velocity() [m^2/s^2].
  Eigen::Matrix3d velocity_covariance() const { return covariance_.block<3, 3>(3, 3); }
  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }  ///< [rad/s]
  double wheel_scale() const { return wheel_scale_; }              ///< Measured over true speed.
  /// Of wheel_scale().
  double wheel_scale_sigma() const { return std::sqrt(covariance_(12, 12)); }
  /// Of gyro_bias() [rad^2/s^2].
  Eigen::Matrix3d gyro_bias_covariance() const { return covariance_.block<3, 3>(6, 6); }

  /// For saving and loading: what changes while it runs.
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
  double wheel_scale_ = 1.0;  ///< Measured over true.
  Covariance covariance_ = Covariance::Zero();
  /// Covariance of the error with the level's error at the last mark, and that one's own.
  Eigen::Matrix<double, 13, 2> with_mark_ = Eigen::Matrix<double, 13, 2>::Zero();
  Eigen::Matrix2d marked_ = Eigen::Matrix2d::Zero();
  double twist_rad_ = 0.0;
  /// Covariance of the error with the level's error at the last standstill, and that one.
  Eigen::Matrix<double, 13, 2> with_rest_ = Eigen::Matrix<double, 13, 2>::Zero();
  RestTilt rest_;
};

}  // namespace understory::lidar_imu_input
