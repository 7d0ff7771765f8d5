// Rigid motions of space, for the smoother.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace understory::factor_graph::graph {

/// A pose in space, `a_T_b` like SE2. A tangent vector is (x, y, z [m], then a rotation vector
/// [rad]), both in the pose's own frame.
struct Pose3 {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  Pose3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back * -translation, back};
  }
  Pose3 operator*(const Pose3& other) const {
    return {translation + rotation * other.translation, (rotation * other.rotation).normalized()};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
};

/// [v]x with [v]x w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);
/// Unit quaternion of a rotation vector [rad], and back; the angle is in [0, pi].
Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v);
Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q);
/// J with Exp(v + d) = Exp(v) Exp(J d) to first order (the right Jacobian of SO(3)).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& v);

}  // namespace understory::factor_graph::graph
