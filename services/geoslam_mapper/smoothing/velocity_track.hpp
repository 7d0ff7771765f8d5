// The vehicle's velocity from scan to scan.
#pragma once

#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/odometry_buffer.hpp"

namespace understory::geoslam_mapper::smoothing {

/// (velocity [m/s], bias of the accelerometer [m/s^2]), each in the axes of the last scan's
/// vehicle.
struct VelocityState {
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Covariance of the pose's error (rows: x, y, theta) with that of the state.
  Eigen::Matrix<double, 3, 4> with_pose = Eigen::Matrix<double, 3, 4>::Zero();

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.mean, s.covariance, s.with_pose);
  }
};

/// A Kalman filter of the velocity and the accelerometer's bias beside the pose from registration.
/// Between scans the IMU propagates them: the uncertainty of a step is below a millimetre, against
/// centimetres by wheels. Owns velocity and bias; the caller owns the pose.
class VelocityTrack {
 public:
  /// Predicted pose of the next scan, from the pose of the last one (right perturbation). `step`:
  /// the motion by odometry; it gives the rotation, and the whole motion while the velocity is
  /// unknown. `inertial`: the motion by the IMU, if there is one.
  geometry::SE2WithCovariance predict(const geometry::SE2WithCovariance& map_T_last,
                                      const geometry::SE2WithCovariance& step,
                                      const std::optional<model::InertialMotion>& inertial);
  /// Updates with the pose of that scan by registration. False if its distance from the prediction
  /// exceeds the limit (one in 10,000): IMU or odometry is not as stated, and the velocity is
  /// reset.
  bool update(const geometry::SE2WithCovariance& map_T_scan);
  /// The last scan's pose was set from another source.
  void set_pose();
  /// Resets the velocity and the bias.
  void forget() { now_.reset(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.now_);
  }

 private:
  void start_with(const geometry::SE2WithCovariance& step, const model::InertialMotion& inertial);
  void learn_from(const geometry::SE2WithCovariance& step, const model::Preintegration& z,
                  geometry::SE2WithCovariance& map_T_last);
  void carry_on(const geometry::SE2WithCovariance& step, const model::Preintegration& z,
                const geometry::SE2WithCovariance& map_T_last);

  std::optional<VelocityState> now_;
  geometry::SE2WithCovariance predicted_;  ///< Predicted pose of the scan for update().
};

}  // namespace understory::geoslam_mapper::smoothing
