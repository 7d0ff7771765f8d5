#include "common/factor_graph/graph/variable.hpp"

#include <cmath>

namespace understory::factor_graph::graph {

Value value_of(const geometry::SE2& pose) {
  return {pose.x(), pose.y(), pose.theta(), std::cos(pose.theta()), std::sin(pose.theta()), 0, 0};
}

Value value_of(const Pose3& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond q = pose.rotation.normalized();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Value value_of(const Eigen::Vector2d& point) { return {point.x(), point.y(), 0, 0, 0, 0, 0}; }
Value value_of(const Eigen::Vector3d& point) {
  return {point.x(), point.y(), point.z(), 0, 0, 0, 0};
}

Value value_of(double scalar) { return {scalar, 0, 0, 0, 0, 0, 0}; }

geometry::SE2 pose2_of(const Value& value) { return {value[0], value[1], value[2]}; }

Pose3 pose3_of(const Value& value) {
  return {{value[0], value[1], value[2]},
          Eigen::Quaterniond(value[6], value[3], value[4], value[5])};
}

Value moved(VariableType type, const Value& base, const double* delta) {
  Value value = base;
  if (type == VariableType::kPose3) {
    const Pose3 at = pose3_of(base);
    const Eigen::Map<const Eigen::Vector3d> rotation(delta + 3);
    return value_of(Pose3{at.translation + Eigen::Map<const Eigen::Vector3d>(delta),
                          at.rotation * exp_rotation(rotation)});
  }
  for (int i = 0; i < dimension(type); ++i) {
    value[static_cast<std::size_t>(i)] += delta[i];
  }
  if (type == VariableType::kPose2) {
    value[3] = std::cos(value[2]);
    value[4] = std::sin(value[2]);
  }
  return value;
}

}  // namespace understory::factor_graph::graph
