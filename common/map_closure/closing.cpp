#include "common/map_closure/closing.hpp"

#include <Eigen/LU>

#include "common/factor_graph/plane/optimise.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "common/geometry/decompositions.hpp"

namespace understory::map_closure {
namespace {

namespace plane = factor_graph::plane;

plane::PoseId pose_id(std::size_t part) { return plane::PoseId(static_cast<std::uint32_t>(part)); }

plane::RelativePose factor_of(const Closure& closure) {
  return {pose_id(closure.from), pose_id(closure.to), closure.from_T_to.mean,
          geometry::symmetric_inverse(closure.from_T_to.covariance)};
}

/// A smoother with the graph, solved at its values.
plane::Smoother solved(const plane::Graph& graph) {
  plane::Smoother smoother;
  smoother.start_from(graph);
  const plane::SmootherUpdate update = smoother.update();
  if (!update.ok) throw ClosureError("its submaps do not hang together: " + update.error);
  return smoother;
}

/// Covariances of its first poses.
std::vector<Eigen::Matrix3d> covariances_in(const plane::Graph& graph, std::size_t count) {
  std::vector<plane::PoseId> poses;
  poses.reserve(count);
  for (std::size_t i = 0; i < count; ++i) poses.push_back(pose_id(i));
  return solved(graph).marginals(poses, {}).poses;
}

}  // namespace

Closure closure_between(const PlacedEnd& from, const PlacedEnd& to,
                        const geometry::SE2WithCovariance& from_end_T_to_end) {
  const geometry::SE2WithCovariance& said = from_end_T_to_end;
  if (!said.mean.coordinates().allFinite() || !said.covariance.allFinite() ||
      !(geometry::eigenvalues(said.covariance)[0] > 0.0))
    throw ClosureError("the pose of the closure, or its standard deviations, are no numbers > 0");
  if (from.part == to.part)
    throw ClosureError("both ends are in one part of the map: nothing can be closed between them");
  const geometry::SE2WithCovariance to_end_T_to{to.part_T_end.inverse(), Eigen::Matrix3d::Zero()};
  const geometry::SE2WithCovariance from_T_end{from.part_T_end, Eigen::Matrix3d::Zero()};
  return {from.part, to.part, compound(compound(from_T_end, said), to_end_T_to)};
}

Expectation expectation(const PartGraph& graph, const Closure& closure) {
  const plane::Smoother smoother = solved(graph.graph);
  const plane::PoseId both[] = {pose_id(closure.from), pose_id(closure.to)};
  const auto joint = smoother.joint_marginal(both, {});
  if (!joint) throw ClosureError("the map does not determine how the two lie to each other");

  Expectation known;
  known.from_T_to.mean = graph.graph[both[0]].inverse() * graph.graph[both[1]];
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -known.from_T_to.mean.inverse().Adjoint(), Eigen::Matrix3d::Identity();
  known.from_T_to.covariance = jacobian * *joint * jacobian.transpose();
  const Eigen::Vector3d off = (known.from_T_to.mean.inverse() * closure.from_T_to.mean).Log();
  const Eigen::Matrix3d sum = known.from_T_to.covariance + closure.from_T_to.covariance;
  known.chi2 = off.dot(geometry::symmetric_inverse(sum) * off);
  return known;
}

ClosedGraph closed(const PartGraph& graph, const Closure& closure) {
  ClosedGraph result;
  result.before = covariances_in(graph.graph, graph.parts.size());
  plane::Graph with = graph.graph;
  with.relative_poses.push_back(factor_of(closure));
  const auto report = plane::optimise(with);
  if (!report.ok) throw ClosureError("its submaps do not hang together: " + report.error);
  result.closure_chi2 = plane::chi2(with, with.relative_poses.back());
  result.graph_chi2 = plane::chi2(with) - result.closure_chi2;
  result.after = covariances_in(with, graph.parts.size());
  result.poses = std::move(with.poses);
  result.poses.resize(graph.parts.size());
  return result;
}

}  // namespace understory::map_closure
