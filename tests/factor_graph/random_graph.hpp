// Random graphs of the plane for the smoothers' tests.
#pragma once

#include <Eigen/Dense>
#include <random>

#include "common/factor_graph/plane/smoother.hpp"

namespace understory::test {

/// Converges as far as numbers go.
inline factor_graph::bayes_tree::IncrementalParameters exact() {
  factor_graph::bayes_tree::IncrementalParameters parameters;
  parameters.least_move = 0.0;
  parameters.relinearise_above = 0.0;
  parameters.max_iterations = 1;
  return parameters;
}

inline Eigen::Vector3d random_tangent(std::mt19937_64& random, double translation, double angle) {
  std::normal_distribution<double> normal;
  const double x = translation * normal(random);
  const double y = translation * normal(random);
  return {x, y, angle * normal(random)};
}

/// A drive among points: every pose sees every point near by and is tied to the one before; values
/// are off by `error`.
inline factor_graph::plane::Graph random_graph(std::mt19937_64& random, int poses, int points,
                                               double error) {
  std::uniform_real_distribution<double> where(-15.0, 15.0);
  std::vector<Eigen::Vector2d> true_points;
  factor_graph::plane::Graph graph;
  for (int i = 0; i < points; ++i) {
    const double x = where(random);
    true_points.emplace_back(x, where(random));
    graph.add_point(true_points.back() + random_tangent(random, error, 0).head<2>());
  }
  geometry::SE2 truth;
  geometry::SE2 before;
  std::normal_distribution<double> normal;
  for (int k = 0; k < poses; ++k) {
    const factor_graph::plane::PoseId pose =
        graph.add_pose(truth * geometry::SE2::Exp(random_tangent(random, error, 0.2 * error)));
    if (k == 0) graph.pose_priors.push_back({pose, truth, 1e6 * Eigen::Matrix3d::Identity()});
    if (k > 0) {
      const geometry::SE2 motion =
          before.inverse() * truth * geometry::SE2::Exp(random_tangent(random, 0.1, 0.05));
      graph.relative_poses.push_back(
          {factor_graph::plane::PoseId(static_cast<std::uint32_t>(k - 1)), pose, motion,
           Eigen::Vector3d(100.0, 100.0, 400.0).asDiagonal()});
    }
    for (int i = 0; i < points; ++i) {
      const Eigen::Vector2d seen = truth.inverse() * true_points[static_cast<std::size_t>(i)];
      if (seen.norm() > 14.0) continue;
      Eigen::Matrix2d information;
      information << 25.0, 5.0, 5.0, 16.0;
      const double x = normal(random);
      const double y = normal(random);
      graph.observations.push_back({pose,
                                    factor_graph::plane::PointId(static_cast<std::uint32_t>(i)),
                                    seen + 0.2 * Eigen::Vector2d(x, y), information});
    }
    before = truth;
    truth = truth * geometry::SE2::Exp(Eigen::Vector3d(1.0, 0.1, 0.25));
  }
  return graph;
}

/// A road with posts on both sides that never comes back: each pose sees those of its surroundings
/// alone, exact odometry ties it to the next. Values are dead reckoned.
inline factor_graph::plane::Graph random_road(std::mt19937_64& random, std::uint32_t poses) {
  constexpr double kStep_m = 4.0;
  constexpr double kSigma_m = 0.01;
  const Eigen::Vector3d step_sigma(3e-3, 3e-3, 2e-4);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> along(-0.5, 0.5);
  factor_graph::plane::Graph graph;
  std::vector<Eigen::Vector2d> true_points;
  geometry::SE2 truth;
  geometry::SE2 reckoned;
  for (std::uint32_t k = 0; k < poses; ++k) {
    const factor_graph::plane::PoseId pose = graph.add_pose(reckoned);
    if (k == 0) graph.pose_priors.push_back({pose, truth, 1e12 * Eigen::Matrix3d::Identity()});
    const double side = k % 2 == 0 ? 8.0 : -8.0;
    true_points.push_back(truth * Eigen::Vector2d(4.0 * kStep_m + along(random), side));
    graph.add_point(reckoned * truth.inverse() * true_points.back());
    for (std::size_t i = k < 9 ? 0 : k - 9; i < true_points.size(); ++i) {
      const double x = kSigma_m * normal(random);
      const double y = kSigma_m * normal(random);
      graph.observations.push_back({pose,
                                    factor_graph::plane::PointId(static_cast<std::uint32_t>(i)),
                                    truth.inverse() * true_points[i] + Eigen::Vector2d(x, y),
                                    Eigen::Matrix2d::Identity() / (kSigma_m * kSigma_m)});
    }
    const geometry::SE2 step(kStep_m, 0.0, 0.05 * std::sin(0.02 * k));
    Eigen::Vector3d error;
    for (int c = 0; c < 3; ++c) error(c) = step_sigma(c) * normal(random);
    truth = truth * step;
    reckoned = reckoned * step * geometry::SE2::Exp(error);
    if (k + 1 == poses) break;
    graph.relative_poses.push_back({pose, factor_graph::plane::PoseId(k + 1),
                                    step * geometry::SE2::Exp(error),
                                    step_sigma.cwiseAbs2().cwiseInverse().asDiagonal()});
  }
  return graph;
}

/// The greatest distance between two graphs' estimates [m, rad].
inline double difference(const factor_graph::plane::Graph& a, const factor_graph::plane::Graph& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    const geometry::SE2 between = a.poses[i].inverse() * b.poses[i];
    largest = std::max(largest, between.coordinates().cwiseAbs().maxCoeff());
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    largest = std::max(largest, (a.points[i] - b.points[i]).norm());
  }
  return largest;
}

}  // namespace understory::test
