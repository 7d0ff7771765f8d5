#include "common/factor_graph/plane/graph.hpp"

#include <numeric>

namespace understory::factor_graph::plane {
namespace {

/// Error with separate translation and rotation, as is usual for pose graphs.
Eigen::Vector3d split_error(const geometry::SE2& measured, const geometry::SE2& actual) {
  return (measured.inverse() * actual).coordinates();
}

template <typename Factors>
double sum_chi2(const Graph& graph, const Factors& factors) {
  double sum = 0.0;
  for (const auto& factor : factors) sum += chi2(graph, factor);
  return sum;
}

}  // namespace

PoseId Graph::add_pose(const geometry::SE2& initial) {
  poses.push_back(initial);
  return PoseId(static_cast<std::uint32_t>(poses.size() - 1));
}

PointId Graph::add_point(const Eigen::Vector2d& initial) {
  points.push_back(initial);
  return PointId(static_cast<std::uint32_t>(points.size() - 1));
}

double chi2(const Graph& graph, const PosePrior& factor) {
  const Eigen::Vector3d e = split_error(factor.mean, graph[factor.pose]);
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const RelativePose& factor) {
  const Eigen::Vector3d e = split_error(factor.a_T_b, graph[factor.a].inverse() * graph[factor.b]);
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const PointPrior& factor) {
  const Eigen::Vector2d e = graph[factor.point] - factor.mean;
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const PointObservation& factor) {
  const geometry::SE2& pose = graph[factor.pose];
  const Eigen::Vector2d e =
      pose.rotation().transpose() * (graph[factor.point] - pose.translation()) - factor.position;
  return e.dot(factor.information * e);
}

geometry::SE2 at_true_rate(const geometry::SE2& measured, double bias, double seconds) {
  const double excess_rad = bias * seconds;
  const Eigen::Vector2d& path = measured.translation();
  return {path - 0.5 * excess_rad * geometry::perpendicular(path), measured.theta() - excess_rad};
}

double chi2(const Graph& graph, const BiasedRelativePose& factor) {
  const RelativePose& motion = factor.motion;
  const double bias = graph[factor.bias];
  // In the axes of the measured motion, as in the smoother's factor.
  Eigen::Vector3d e = split_error(motion.a_T_b, graph[motion.a].inverse() * graph[motion.b]);
  const geometry::SE2 shift =
      motion.a_T_b.inverse() * at_true_rate(motion.a_T_b, bias, factor.seconds);
  e -= shift.coordinates();
  return e.dot(motion.information * e);
}

double chi2(const Graph& graph, const ScalarPrior& factor) {
  const double e = graph[factor.scalar] - factor.mean;
  return e * factor.information * e;
}

double chi2(const Graph& graph, const ScalarStep& factor) {
  const double e = graph[factor.b] - graph[factor.a];
  return e * factor.information * e;
}

double chi2(const Graph& graph) {
  return sum_chi2(graph, graph.pose_priors) + sum_chi2(graph, graph.relative_poses) +
         sum_chi2(graph, graph.point_priors) + sum_chi2(graph, graph.observations) +
         sum_chi2(graph, graph.biased_relative_poses) + sum_chi2(graph, graph.scalar_priors) +
         sum_chi2(graph, graph.scalar_steps);
}

ObservationJacobian linearise(const Graph& graph, const PointObservation& factor) {
  ObservationJacobian result = linearise(graph[factor.pose], graph[factor.point]);
  result.residual -= factor.position;
  return result;
}

ObservationJacobian linearise(const geometry::SE2& pose, const Eigen::Vector2d& point) {
  const Eigen::Matrix2d to_pose = pose.rotation().transpose();
  const Eigen::Vector2d local = to_pose * (point - pose.translation());
  ObservationJacobian result;
  result.residual = local;
  result.pose << -Eigen::Matrix2d::Identity(), -geometry::perpendicular(local);
  result.point = to_pose;
  return result;
}

RelativePoseJacobian linearise(const Graph& graph, const RelativePose& factor) {
  const geometry::SE2 b_T_a = graph[factor.b].inverse() * graph[factor.a];
  const geometry::SE2 error = factor.a_T_b.inverse() * b_T_a.inverse();
  RelativePoseJacobian result;
  result.residual = error.coordinates();
  result.b.setIdentity();
  result.b.topLeftCorner<2, 2>() = error.rotation();
  result.a = -result.b * b_T_a.Adjoint();
  return result;
}

}  // namespace understory::factor_graph::plane
