#include "tests/factor_graph/batch_smoother.hpp"

#include <Eigen/Dense>
#include <random>

#include "tests/catch.hpp"
#include "tests/factor_graph/normal_equations.hpp"

using namespace understory;
using namespace understory::test;

namespace {

Eigen::Vector3d random_tangent(std::mt19937_64& random, double translation, double angle) {
  std::normal_distribution<double> normal;
  return {translation * normal(random), translation * normal(random), angle * normal(random)};
}

/// A drive among points: every pose sees every point near by and is tied to the one before; values
/// are off by `error`.
factor_graph::plane::Graph random_graph(std::mt19937_64& random, int poses, int points,
                                        double error) {
  std::uniform_real_distribution<double> where(-15.0, 15.0);
  std::vector<Eigen::Vector2d> true_points;
  factor_graph::plane::Graph graph;
  for (int i = 0; i < points; ++i) {
    true_points.emplace_back(where(random), where(random));
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
      graph.observations.push_back(
          {pose, factor_graph::plane::PointId(static_cast<std::uint32_t>(i)),
           seen + 0.2 * Eigen::Vector2d(normal(random), normal(random)), information});
    }
    before = truth;
    truth = truth * geometry::SE2::Exp(Eigen::Vector3d(1.0, 0.1, 0.25));
  }
  return graph;
}

/// Gradient of chi^2 / 2 by central differences over one pose.
Eigen::Vector3d numerical_gradient(factor_graph::plane::Graph graph,
                                   factor_graph::plane::PoseId pose) {
  Eigen::Vector3d gradient;
  const geometry::SE2 at = graph[pose];
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d d = 1e-6 * Eigen::Vector3d::Unit(k);
    graph.poses[index(pose)] = at * geometry::SE2::Exp(d);
    const double plus = chi2(graph);
    graph.poses[index(pose)] = at * geometry::SE2::Exp(-d);
    gradient[k] = 0.5 * (plus - chi2(graph)) / 2e-6;
  }
  return gradient;
}

Eigen::MatrixXd dense(const factor_graph::batch::SymmetricSparse& matrix) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(matrix.size, matrix.size);
  for (int c = 0; c < matrix.size; ++c) {
    for (int k = matrix.column_starts[c]; k < matrix.column_starts[c + 1]; ++k) {
      result(matrix.rows[k], c) = matrix.values[k];
      result(c, matrix.rows[k]) = matrix.values[k];
    }
  }
  return result;
}

}  // namespace

TEST_CASE("The gradient equals the numerical one", "[factor_graph]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const factor_graph::plane::Graph graph = random_graph(random, 6, 12, 0.3);
    test::NormalEquations equations(graph);
    equations.linearise(graph);
    REQUIRE(equations.chi2() == Approx(chi2(graph)));
    for (std::uint32_t k = 0; k < graph.poses.size(); ++k) {
      const Eigen::Vector3d expected = numerical_gradient(graph, factor_graph::plane::PoseId(k));
      const Eigen::Vector3d actual =
          equations.gradient().segment<3>(equations.column(factor_graph::plane::PoseId(k)));
      REQUIRE((actual - expected).norm() < 2e-7 * (1.0 + expected.norm()));
    }
  }
}

TEST_CASE("The optimum has no gradient, and marginals equal the dense inverse", "[factor_graph]") {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    test::BatchSmootherParameters parameters;
    parameters.max_iterations = 50;
    parameters.converged_m = parameters.converged_rad = 1e-10;
    test::BatchSmoother smoother(parameters);
    smoother.graph() = random_graph(random, 12, 15, 0.3);
    const test::BatchUpdate update = smoother.update();
    REQUIRE(update.ok);
    REQUIRE(update.converged);
    test::NormalEquations equations(smoother.graph());
    equations.linearise(smoother.graph());
    const Eigen::MatrixXd hessian = dense(equations.hessian());
    REQUIRE((hessian - hessian.transpose()).norm() == 0.0);
    REQUIRE(equations.gradient().norm() < 1e-11 * hessian.norm());
    const std::vector<factor_graph::plane::PoseId> poses{factor_graph::plane::PoseId(3),
                                                         factor_graph::plane::PoseId(7)};
    const std::vector<factor_graph::plane::PointId> points{
        smoother.graph().observations.front().point};
    const auto marginal = smoother.joint_marginal(poses, points);
    REQUIRE(marginal);
    const Eigen::MatrixXd inverse = hessian.inverse();
    const int a = equations.column(factor_graph::plane::PoseId(3));
    const int b = equations.column(factor_graph::plane::PoseId(7));
    const int p = equations.column(points[0]);
    REQUIRE((marginal->block<3, 3>(0, 3) - inverse.block<3, 3>(a, b)).norm() < 1e-9);
    REQUIRE((marginal->block<3, 3>(0, 0) - inverse.block<3, 3>(a, a)).norm() < 1e-9);
    REQUIRE((marginal->block<2, 3>(6, 3) - inverse.block<2, 3>(p, b)).norm() < 1e-9);
  }
}

TEST_CASE("Two edges between the same variables keep the Hessian whole", "[factor_graph]") {
  std::mt19937_64 random(3);
  test::BatchSmoother smoother;
  smoother.graph() = random_graph(random, 5, 10, 0.1);
  const factor_graph::plane::PointObservation again = smoother.graph().observations[3];
  smoother.graph().observations.push_back(again);
  smoother.graph().relative_poses.push_back(smoother.graph().relative_poses[1]);
  factor_graph::plane::RelativePose backwards = smoother.graph().relative_poses[2];
  std::swap(backwards.a, backwards.b);
  backwards.a_T_b = backwards.a_T_b.inverse();
  smoother.graph().relative_poses.push_back(backwards);
  REQUIRE(smoother.update().ok);
  test::NormalEquations equations(smoother.graph());
  equations.linearise(smoother.graph());
  Eigen::LLT<Eigen::MatrixXd> llt(dense(equations.hessian()));
  REQUIRE(llt.info() == Eigen::Success);
}

TEST_CASE("Rollback restores the graph exactly", "[factor_graph]") {
  std::mt19937_64 random(4);
  test::BatchSmoother smoother;
  smoother.graph() = random_graph(random, 8, 10, 0.1);
  REQUIRE(smoother.update().ok);
  const factor_graph::plane::Graph before = smoother.graph();
  smoother.checkpoint();
  const factor_graph::plane::PoseId pose = smoother.graph().add_pose(geometry::SE2(50, 50, 1));
  smoother.graph().observations.push_back(
      {pose, factor_graph::plane::PointId(0), {3, 3}, Eigen::Matrix2d::Identity()});
  smoother.graph().observations.push_back(
      {pose, factor_graph::plane::PointId(2), {-3, 3}, Eigen::Matrix2d::Identity()});
  REQUIRE(smoother.update().ok);
  smoother.rollback();
  REQUIRE(smoother.graph().poses.size() == before.poses.size());
  REQUIRE(smoother.graph().observations.size() == before.observations.size());
  for (std::size_t i = 0; i < before.poses.size(); ++i) {
    REQUIRE(smoother.graph().poses[i].coordinates() == before.poses[i].coordinates());
  }
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    REQUIRE(smoother.graph().points[i] == before.points[i]);
  }
}

TEST_CASE("A graph with a free gauge gives an error that names a variable", "[factor_graph]") {
  test::BatchSmoother smoother;
  const factor_graph::plane::PoseId a = smoother.graph().add_pose(geometry::SE2());
  const factor_graph::plane::PoseId b = smoother.graph().add_pose(geometry::SE2(1, 0, 0));
  smoother.graph().relative_poses.push_back(
      {a, b, geometry::SE2(1, 0, 0), Eigen::Matrix3d::Identity()});
  const test::BatchUpdate update = smoother.update();
  REQUIRE_FALSE(update.ok);
  REQUIRE(update.error.find("pose") != std::string::npos);
  REQUIRE_FALSE(smoother.joint_marginal(std::vector<factor_graph::plane::PoseId>{a}, {}));
}

TEST_CASE("Marginals agree with Monte Carlo", "[factor_graph]") {
  std::mt19937_64 random(5);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d stated = Eigen::Matrix3d::Zero();
  const int runs = 400;
  std::normal_distribution<double> normal;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 world(6);
    std::uniform_real_distribution<double> where(-10.0, 10.0);
    test::BatchSmoother smoother;
    factor_graph::plane::Graph& graph = smoother.graph();
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < 12; ++i) {
      points.emplace_back(where(world), where(world));
      graph.add_point(points.back());
    }
    geometry::SE2 truth;
    for (int k = 0; k < 5; ++k) {
      const factor_graph::plane::PoseId pose = graph.add_pose(truth);
      if (k == 0) graph.pose_priors.push_back({pose, truth, 1e8 * Eigen::Matrix3d::Identity()});
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector2d noise = 0.1 * Eigen::Vector2d(normal(random), normal(random));
        graph.observations.push_back({pose, factor_graph::plane::PointId(i),
                                      truth.inverse() * points[i] + noise,
                                      100.0 * Eigen::Matrix2d::Identity()});
      }
      if (k < 4) truth = truth * geometry::SE2(1.0, 0.2, 0.3);
    }
    REQUIRE(smoother.update().ok);
    const Eigen::Vector3d e =
        (smoother.graph()[factor_graph::plane::PoseId(4)].inverse() * truth).Log();
    sum += e * e.transpose() / runs;
    stated = *smoother.joint_marginal(
        std::vector<factor_graph::plane::PoseId>{factor_graph::plane::PoseId(4)}, {});
  }
  REQUIRE((stated.inverse() * sum).trace() / 3.0 == Approx(1.0).margin(0.15));
}
