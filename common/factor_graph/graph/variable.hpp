// Variables of a factor graph and their values.
#pragma once

#include <array>
#include <cstdint>

#include "common/factor_graph/graph/pose3.hpp"
#include "common/geometry/se2.hpp"

namespace understory::factor_graph::graph {

/// Number of a variable in its graph. The number of a removed variable is reused.
enum class VariableId : std::int32_t {};
enum class FactorId : std::int32_t {};  ///< Number of a factor; likewise reused.
/// The number itself.
constexpr int index(VariableId id) { return static_cast<int>(id); }
/// The number itself.
constexpr int index(FactorId id) { return static_cast<int>(id); }

/// Kinds of variables; see Value for their numbers.
enum class VariableType : std::uint8_t { kPose2, kPose3, kPoint2, kPoint3, kScalar };

/// Degrees of freedom of a variable.
constexpr int dimension(VariableType type) {
  constexpr std::array<int, 5> dimensions{3, 6, 2, 3, 1};
  return dimensions[static_cast<std::size_t>(type)];
}
/// Degrees of freedom of a pose3.
constexpr int kMaxVariableDimension = 6;

/// Numbers of a variable's value:
///   pose2: x, y [m], theta [rad, not wrapped], cos theta, sin theta
///   pose3: x, y, z [m], quaternion x, y, z, w (body to world)
///   point: x, y (, z) [m]
///   scalar: itself, in a unit of its own
using Value = std::array<double, 7>;

/// Coordinates of a variable in a chart about its `base`: (x, y, theta) of a pose2 and the
/// coordinates of points are added; a pose3 is (translation + d[0..2], rotation * Exp(d[3..5])). In
/// the plane this chart is exact at any distance, so the base need not change.
using Delta = std::array<double, kMaxVariableDimension>;

/// Numbers of a pose in the plane.
Value value_of(const geometry::SE2& pose);
/// Numbers of a pose in space; the quaternion is normalised.
Value value_of(const Pose3& pose);
/// Numbers of a point in the plane [m].
Value value_of(const Eigen::Vector2d& point);
/// Numbers of a point in space [m].
Value value_of(const Eigen::Vector3d& point);
/// Numbers of a scalar.
Value value_of(double scalar);
/// Pose in the plane from its numbers.
geometry::SE2 pose2_of(const Value& value);
/// Pose in space from its numbers.
Pose3 pose3_of(const Value& value);
/// Point in the plane from its numbers [m].
inline Eigen::Vector2d point2_of(const Value& value) { return {value[0], value[1]}; }
/// Point in space from its numbers [m].
inline Eigen::Vector3d point3_of(const Value& value) { return {value[0], value[1], value[2]}; }

/// The value at `delta` about `base`.
Value moved(VariableType type, const Value& base, const double* delta);

}  // namespace understory::factor_graph::graph
