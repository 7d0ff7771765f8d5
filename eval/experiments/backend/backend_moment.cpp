#include "eval/experiments/backend/backend_moment.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "eval/experiments/backend/backend_batch.hpp"

namespace understory::eval::experiments::backend {
namespace {

using factor_graph::graph::FactorGraph;
using factor_graph::graph::Value;
using factor_graph::graph::VariableId;
using factor_graph::graph::VariableType;

/// From one value to another, in the first one's own frame for poses.
Eigen::VectorXd between(VariableType type, const Value& from, const Value& to) {
  switch (type) {
    case VariableType::kPose2: {
      const geometry::SE2 move =
          factor_graph::graph::pose2_of(from).inverse() * factor_graph::graph::pose2_of(to);
      return Eigen::Vector3d(move.x(), move.y(), move.theta());
    }
    case VariableType::kPose3: {
      const factor_graph::graph::Pose3 move =
          factor_graph::graph::pose3_of(from).inverse() * factor_graph::graph::pose3_of(to);
      return (Eigen::VectorXd(6) << move.translation,
              factor_graph::graph::log_rotation(move.rotation))
          .finished();
    }
    default:
      return Eigen::Map<const Eigen::VectorXd>(to.data(), dimension(type)) -
             Eigen::Map<const Eigen::VectorXd>(from.data(), dimension(type));
  }
}

int length_dimensions(VariableType type) {
  return type == VariableType::kPose2 || type == VariableType::kPoint2 ? 2 : 3;
}

std::optional<Distance> distance_of(factor_graph::bayes_tree::IncrementalSmoother& smoother,
                                    const FactorGraph& batch, VariableId id) {
  const auto covariance = smoother.joint_covariance({&id, 1});
  if (!covariance) return std::nullopt;
  const VariableType type = batch.type(id);
  const Eigen::VectorXd move = between(type, smoother.graph().value(id), batch.value(id));
  const double squared = move.dot(covariance->ldlt().solve(move));
  return Distance{std::sqrt(std::max(0.0, squared)), move.head(length_dimensions(type)).norm()};
}

}  // namespace

Moment moment_of(factor_graph::bayes_tree::IncrementalSmoother& smoother, VariableId newest,
                 int poses) {
  Moment moment;
  moment.poses = poses;
  moment.chi2 = smoother.graph().chi2();
  FactorGraph batch = copy_of(smoother.graph());
  const factor_graph::batch::BatchReport report = solve_whole(batch);
  moment.chi2_batch = report.chi2;
  moment.is_verified = report.ok && report.converged;

  std::set<int> seen;
  for (int f = 0; f < batch.factor_capacity(); ++f) {
    const auto variables = batch.variables_of(f);
    if (std::find(variables.begin(), variables.end(), index(newest)) == variables.end()) continue;
    seen.insert(variables.begin(), variables.end());
  }
  seen.erase(index(newest));

  moment.newest = distance_of(smoother, batch, newest).value_or(Distance{});
  for (const int v : seen) {
    if (const auto distance = distance_of(smoother, batch, VariableId(v))) {
      moment.seen_sigma.push_back(distance->sigma);
    }
  }
  return moment;
}

}  // namespace understory::eval::experiments::backend
