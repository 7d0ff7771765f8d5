// A part of a graph as one condensed measurement.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"

namespace understory::factor_graph::plane {

/// A point of the part, in the frame of its origin.
struct CondensedPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< [m]
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< [m^2]
};

/// An outer pose in the frame of the origin.
struct CondensedMotion {
  geometry::SE2WithCovariance origin_T_outer;  ///< At the present bias.
  double seconds = 0.0;  ///< The heading of the outer pose decreases by this much per bias [s].
};

/// The information of the factors of a part of a graph, in the frame of one pose, its origin. To
/// use it, replace the inner poses by one pose with an observation of each point and a motion to
/// each outer pose.
struct CondensedPart {
  geometry::SE2 map_T_origin;  ///< Pose of the origin at the graph's values.
  std::vector<geometry::SE2WithCovariance> origin_T_inner;
  std::vector<CondensedMotion> outer;
  std::vector<CondensedPoint> points;
  /// The part's measurement of the bias: its change from the graph's value, and the information on
  /// it.
  double bias_step = 0.0;
  double bias_information = 0.0;  ///< [1/(rad/s)^2]; 0 = none.
};

/// Condenses a part by its own factors (thesis on submaps §2.3.3, §3.4.2). The first poses are the
/// `inner` ones, with observations of points and motions among each other; then follow the outer
/// ones, each with a motion to an inner one. The scalars are one bias at several times so close
/// that they change together. Other factors are not used. The thesis uses the middle pose of the
/// track as origin and the joint covariance of the shared variables. Here the origin is a frame
/// near the middle pose that moves with the points: it carries the common error of the points
/// relative to that pose, so that the remaining errors of the points can be treated as independent.
/// It is linearised once, at the graph's values. None where the factors do not determine a pose, or
/// where a point has no observation. Cost: cubic in the poses, for each point quadratic in its
/// observations.
std::optional<CondensedPart> condense(const Graph& part, std::size_t inner);

}  // namespace understory::factor_graph::plane
