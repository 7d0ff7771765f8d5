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
  geometry::SE2WithCovariance origin_T_outer;  ///< With the bias as it is.
  double seconds = 0.0;  ///< The heading of the outer pose falls by so much per bias [s].
};

/// What the factors of a part of a graph say, in the frame of one pose, its origin. To use it, put
/// one pose in the place of the inner poses, with an observation of each point and a motion to each
/// outer pose.
struct CondensedPart {
  geometry::SE2 map_T_origin;  ///< Where the origin is at the graph's values.
  std::vector<geometry::SE2WithCovariance> origin_T_inner;
  std::vector<CondensedMotion> outer;
  std::vector<CondensedPoint> points;
  /// What the part measures of the bias: its move from the graph's values, and the information on
  /// it.
  double bias_step = 0.0;
  double bias_information = 0.0;  ///< [1/(rad/s)^2]; 0: nothing.
};

/// Condenses a part by its own factors (thesis on submaps §2.3.3, §3.4.2). The poses are `inner`
/// ones, which have observations of points and motions among each other, and then outer ones, which
/// have a motion to an inner one each. The scalars are one bias at times so near to each other that
/// they move together. Other factors do not count. The thesis takes the middle pose
/// of the track as origin and the joint covariance of what is shared. Here the origin is the frame
/// near the middle pose that moves with the points: the error that the points have in common
/// relative to that pose is the origin's, so that each of the rest can count by itself. Linearised
/// once, at the graph's values. None where the factors leave a pose undetermined, or where a point
/// has no observation. Cost: cubic in the poses, for each point quadratic in its observations.
std::optional<CondensedPart> condense(const Graph& part, std::size_t inner);

}  // namespace understory::factor_graph::plane
