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
  /// Of the pose's error (rows: x, y, theta) with theirs.
  Eigen::Matrix<double, 3, 4> with_pose = Eigen::Matrix<double, 3, 4>::Zero();

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.mean, s.covariance, s.with_pose);
  }
};

/// A Kalman filter of the velocity and the accelerometer's bias beside the pose that registration
/// finds. Between scans the IMU carries them on: of a step that wheels state with centimetres it
/// leaves less than a millimetre open. Owns velocity and bias; the pose is its user's.
class VelocityTrack {
 public:
  /// Where the next scan is, from the pose of the last one (right perturbation). `step` is the same
  /// motion by odometry: the rotation is its, and where the velocity is not known, all. `inertial`
  /// is the motion by the IMU, where there is one.
  geometry::SE2WithCovariance predict(const geometry::SE2WithCovariance& map_T_last,
                                      const geometry::SE2WithCovariance& step,
                                      const std::optional<model::InertialMotion>& inertial);
  /// The pose of that scan as registration found it from the prediction. False where it is farther
  /// from it than one in 10,000: the IMU or the odometry is not as stated, and the velocity is
  /// forgotten.
  bool update(const geometry::SE2WithCovariance& map_T_scan);
  /// The last scan's pose is known from elsewhere now.
  void set_pose();
  /// Nothing is known.
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
  geometry::SE2WithCovariance predicted_;  ///< Of the scan that update() is told of.
};

}  // namespace understory::geoslam_mapper::smoothing
