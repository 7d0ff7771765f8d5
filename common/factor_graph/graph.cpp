#include "common/factor_graph/graph.hpp"

#include <numeric>

namespace understory {
namespace {

template <typename Factors>
double sum_chi2(const Graph& graph, const Factors& factors) {
  double sum = 0.0;
  for (const auto& factor : factors) sum += chi2(graph, factor);
  return sum;
}

}  // namespace

PoseId Graph::add_pose(const SE2& initial) {
  poses.push_back(initial);
  return PoseId(static_cast<std::uint32_t>(poses.size() - 1));
}

PointId Graph::add_point(const Eigen::Vector2d& initial) {
  points.push_back(initial);
  return PointId(static_cast<std::uint32_t>(points.size() - 1));
}

double chi2(const Graph& graph, const PosePrior& factor) {
  const Eigen::Vector3d e = (factor.mean.inverse() * graph[factor.pose]).Log();
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const RelativePose& factor) {
  const Eigen::Vector3d e =
      (factor.a_T_b.inverse() * graph[factor.a].inverse() * graph[factor.b]).Log();
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const PointPrior& factor) {
  const Eigen::Vector2d e = graph[factor.point] - factor.mean;
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph, const PointObservation& factor) {
  const SE2& pose = graph[factor.pose];
  const Eigen::Vector2d e =
      pose.rotation().transpose() * (graph[factor.point] - pose.translation()) - factor.position;
  return e.dot(factor.information * e);
}

double chi2(const Graph& graph) {
  return sum_chi2(graph, graph.pose_priors) + sum_chi2(graph, graph.relative_poses) +
         sum_chi2(graph, graph.point_priors) + sum_chi2(graph, graph.observations);
}

ObservationJacobian linearise(const Graph& graph, const PointObservation& factor) {
  const SE2& pose = graph[factor.pose];
  const Eigen::Matrix2d to_pose = pose.rotation().transpose();
  const Eigen::Vector2d seen = to_pose * (graph[factor.point] - pose.translation());
  ObservationJacobian result;
  result.residual = seen - factor.position;
  result.pose << -Eigen::Matrix2d::Identity(), -turned_left(seen);
  result.point = to_pose;
  return result;
}

RelativePoseJacobian linearise(const Graph& graph, const RelativePose& factor) {
  const SE2 b_T_a = graph[factor.b].inverse() * graph[factor.a];
  RelativePoseJacobian result;
  result.residual = (factor.a_T_b.inverse() * b_T_a.inverse()).Log();
  result.b = inverse_right_jacobian(result.residual);
  result.a = -result.b * b_T_a.Adjoint();
  return result;
}

}  // namespace understory
