// Rigid motions of space, for the smoother.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace understory::factor_graph::graph {

/// A pose in space, `a_T_b` like SE2. A tangent vector is (x, y, z [m], then a rotation vector
/// [rad]), both in the pose's own frame.
struct Pose3 {
  /// Position of the origin of b in a [m].
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  /// Unit quaternion from b to a.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  /// b_T_a.
  Pose3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back * -translation, back};
  }
  /// a_T_c = a_T_b * b_T_c.
  Pose3 operator*(const Pose3& other) const {
    return {translation + rotation * other.translation, (rotation * other.rotation).normalized()};
  }
  /// Transforms a point [m] from b to a.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
};

/// [v]x with [v]x w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);
/// Unit quaternion of a rotation vector [rad].
Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v);
/// Rotation vector of a unit quaternion [rad]; its length is in [0, pi].
Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q);
/// J with Exp(v + d) = Exp(v) Exp(J d) to first order (the right Jacobian of SO(3)).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& v);

}  // namespace understory::factor_graph::graph
