#include "eval/baselines/mapper/graph.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "common/geometry/se2.hpp"
#include "tests/baseline/clouds.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

Eigen::VectorXd flatten(const eval::baselines::mapper::Graph& graph) {
  Eigen::VectorXd x(3 * static_cast<Eigen::Index>(graph.poses.size()) +
                    2 * static_cast<Eigen::Index>(graph.landmarks_m.size()));
  Eigen::Index at = 0;
  for (const Eigen::Vector3d& pose : graph.poses) {
    x.segment<3>(at) = pose;
    at += 3;
  }
  for (const Eigen::Vector2d& landmark : graph.landmarks_m) {
    x.segment<2>(at) = landmark;
    at += 2;
  }
  return x;
}

Eigen::VectorXd residuals(const eval::baselines::mapper::Graph& graph, const Eigen::VectorXd& x) {
  const auto pose = [&](std::uint32_t i) { return Eigen::Vector3d(x.segment<3>(3L * i)); };
  const auto first_landmark = 3 * static_cast<Eigen::Index>(graph.poses.size());
  std::vector<double> all;

  for (const eval::baselines::mapper::PoseEdge& edge : graph.pose_edges) {
    const auto to_se2 = [](const Eigen::Vector3d& p) { return geometry::SE2(p.x(), p.y(), p.z()); };
    const geometry::SE2 error = to_se2(edge.difference).inverse() *
                                (to_se2(pose(edge.from)).inverse() * to_se2(pose(edge.to)));
    all.insert(all.end(), {error.x(), error.y(), error.theta()});
  }

  for (const eval::baselines::mapper::LandmarkEdge& edge : graph.landmark_edges) {
    const Eigen::Vector3d p = pose(edge.pose);
    const Eigen::Vector2d landmark = x.segment<2>(first_landmark + 2L * edge.landmark);
    const Eigen::Vector2d error =
        geometry::SE2(p.x(), p.y(), p.z()).inverse() * landmark - edge.measured_m;
    all.insert(all.end(), {error.x(), error.y()});
  }
  return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// The whole dense system with a Jacobian from five-point differences: the prior is weak, so their
/// error counts.
Eigen::VectorXd dense_step(const eval::baselines::mapper::Graph& graph) {
  const Eigen::VectorXd x = flatten(graph);
  const Eigen::VectorXd r = residuals(graph, x);
  Eigen::MatrixXd jacobian(r.size(), x.size());

  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto at = [&](double change) {
      Eigen::VectorXd y = x;
      y(i) += change;
      return residuals(graph, y);
    };
    const double h = 1e-3;
    jacobian.col(i) = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
  }

  Eigen::MatrixXd h = 100.0 * jacobian.transpose() * jacobian;
  h.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity();
  return h.ldlt().solve(100.0 * jacobian.transpose() * r);
}

eval::baselines::mapper::Graph random_graph(bool with_double_edges, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, 0.2);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  eval::baselines::mapper::Graph graph;
  graph.landmarks_m = test::random_cloud(12, 40.0, random);

  for (std::uint32_t p = 0; p < 5; ++p) {
    graph.poses.emplace_back(4.0 * p, 2.0 * p, 0.6 * p);
    if (p > 0) {
      graph.pose_edges.push_back({p - 1, p, graph.poses[p] - graph.poses[p - 1]});
    }
    const geometry::SE2 map_T_pose(graph.poses[p].x(), graph.poses[p].y(), graph.poses[p].z());
    for (std::uint32_t l = 0; l < graph.landmarks_m.size(); ++l) {
      const int edges = with_double_edges && chance(random) < 0.3 ? 2 : 1;
      for (int i = 0; i < edges; ++i) {
        const double dx = noise(random);
        graph.landmark_edges.push_back(
            {p, l,
             map_T_pose.inverse() * graph.landmarks_m[l] + Eigen::Vector2d(dx, noise(random))});
      }
    }
  }
  return graph;
}

TEST_CASE("A step solves the whole linear system, also with two edges from one pose") {
  std::mt19937_64 random(1);
  for (const bool with_double_edges : {false, true}) {
    for (int round = 0; round < 20; ++round) {
      const eval::baselines::mapper::Graph graph = random_graph(with_double_edges, random);
      const auto step = gauss_newton_step(graph);
      REQUIRE(step);
      eval::baselines::mapper::Graph found;
      found.poses = step->poses;
      found.landmarks_m = step->landmarks_m;
      CHECK((flatten(found) - dense_step(graph)).norm() < 1e-5);
    }
  }
}

TEST_CASE("Pose 0 stays where it is") {
  std::mt19937_64 random(2);
  const eval::baselines::mapper::Graph graph = random_graph(true, random);
  const auto step = gauss_newton_step(graph);
  REQUIRE(step);
  CHECK(step->poses[0].norm() < 1e-9);
}

TEST_CASE("A landmark without an observation does not move") {
  std::mt19937_64 random(3);
  eval::baselines::mapper::Graph graph = random_graph(false, random);
  graph.landmarks_m.emplace_back(100.0, 100.0);
  const auto step = gauss_newton_step(graph);
  REQUIRE(step);
  CHECK(step->landmarks_m.back() == Eigen::Vector2d::Zero());
}

TEST_CASE("A graph without a determined solution is refused") {
  eval::baselines::mapper::Graph graph;
  graph.poses = {Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, 0.0, 0.0)};
  CHECK_FALSE(gauss_newton_step(graph));
}

}  // namespace
}  // namespace understory::test
