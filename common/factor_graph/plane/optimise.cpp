#include "common/factor_graph/plane/optimise.hpp"

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::plane {
namespace {

/// The variables of a plane graph in a factor graph.
struct Names {
  std::vector<graph::VariableId> poses;
  std::vector<graph::VariableId> points;
  std::vector<graph::VariableId> scalars;

  graph::VariableId operator()(PoseId id) const { return poses[index(id)]; }
  graph::VariableId operator()(PointId id) const { return points[index(id)]; }
  graph::VariableId operator()(ScalarId id) const { return scalars[index(id)]; }
};

Names add_variables(const Graph& from, graph::FactorGraph& to) {
  Names names;
  names.poses.reserve(from.poses.size());
  names.points.reserve(from.points.size());
  names.scalars.reserve(from.scalars.size());
  for (const geometry::SE2& pose : from.poses) names.poses.push_back(to.add(pose));
  for (const Eigen::Vector2d& point : from.points) names.points.push_back(to.add(point));
  for (const double scalar : from.scalars) names.scalars.push_back(to.add(scalar));
  return names;
}

void add_factors(const Graph& from, const Names& name, graph::FactorGraph& to) {
  for (const PosePrior& f : from.pose_priors)
    to.add(graph::prior(name(f.pose), f.mean, f.information));
  for (const PointPrior& f : from.point_priors)
    to.add(graph::prior(name(f.point), f.mean, f.information));
  for (const RelativePose& f : from.relative_poses)
    to.add(graph::relative(name(f.a), name(f.b), f.a_T_b, f.information));
  for (const PointObservation& f : from.observations)
    to.add(graph::observation(name(f.pose), name(f.point), f.position, f.information));
  for (const BiasedRelativePose& f : from.biased_relative_poses) {
    const RelativePose& motion = f.motion;
    to.add(graph::biased_relative(name(motion.a), name(motion.b), name(f.bias), motion.a_T_b,
                                  f.seconds, motion.information));
  }
  for (const ScalarPrior& f : from.scalar_priors)
    to.add(graph::prior(name(f.scalar), f.mean, f.information));
  for (const ScalarStep& f : from.scalar_steps)
    to.add(graph::step(name(f.a), name(f.b), f.information));
}

}  // namespace

batch::BatchReport optimise(Graph& graph, const batch::BatchParameters& parameters) {
  graph::FactorGraph factors;
  const Names names = add_variables(graph, factors);
  add_factors(graph, names, factors);
  batch::BatchReport report = batch::optimise(factors, parameters);
  for (std::size_t i = 0; i < graph.poses.size(); ++i)
    graph.poses[i] = graph::pose2_of(factors.value(names.poses[i]));
  for (std::size_t i = 0; i < graph.points.size(); ++i)
    graph.points[i] = graph::point2_of(factors.value(names.points[i]));
  for (std::size_t i = 0; i < graph.scalars.size(); ++i)
    graph.scalars[i] = factors.value(names.scalars[i])[0];
  return report;
}

}  // namespace understory::factor_graph::plane
