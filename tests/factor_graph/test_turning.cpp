// Motions measured by an instrument that is off by a scalar of the graph.
#include <random>

#include "common/factor_graph/batch.hpp"
#include "common/factor_graph/smoother.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/graph_copy.hpp"
#include "tests/factor_graph/random_graph.hpp"

using namespace understory;

namespace {

constexpr double kSeconds = 0.8;

/// The road's graph, its motions turned too far by a rate that walks; a scalar for five of them.
Graph with_gyro(Graph graph, double rate, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < graph.relative_poses.size(); ++k) {
    if (k % 5 == 0) {
      const ScalarId id{static_cast<std::uint32_t>(graph.scalars.size())};
      if (graph.scalars.empty()) {
        graph.scalar_priors.push_back({id, 0.0, 1e4});
      } else {
        graph.scalar_steps.push_back({ScalarId(index(id) - 1), id, 1e6});
      }
      graph.scalars.push_back(0.0);
    }
    rate += 1e-3 * normal(random);
    RelativePose motion = graph.relative_poses[k];
    // at_true_rate takes a rate out; this puts it in.
    motion.a_T_b = at_true_rate(motion.a_T_b, -rate, kSeconds);
    graph.turning_poses.push_back(
        {motion, ScalarId(static_cast<std::uint32_t>(graph.scalars.size() - 1)), kSeconds});
  }
  graph.relative_poses.clear();
  return graph;
}

}  // namespace

TEST_CASE("A turning pose's derivative equals the numerical one", "[factor_graph]") {
  std::mt19937_64 random(5);
  const std::array<VariableType, 3> types{VariableType::kPose2, VariableType::kPose2,
                                          VariableType::kScalar};
  for (int trial = 0; trial < 20; ++trial) {
    const SE2 a = SE2::Exp(random_tangent(random, 5.0, 1.0));
    const SE2 measured = SE2::Exp(random_tangent(random, 3.0, 0.5));
    const SE2 b = a * measured * SE2::Exp(random_tangent(random, 0.2, 0.1));
    std::array<Value, 3> values{value_of(a), value_of(b), value_of(0.1 * trial)};
    const Factor factor = turning(VariableId(0), VariableId(1), VariableId(2), measured, kSeconds,
                                  Eigen::Matrix3d::Identity());
    const auto residual = [&](Eigen::Matrix<double, 3, 7>* jacobian) {
      Eigen::Vector3d e;
      const std::array<const Value*, 3> pointers{&values[0], &values[1], &values[2]};
      evaluate(factor.kind, factor.measurement.data(), pointers, types, e.data(),
               jacobian == nullptr ? nullptr : jacobian->data());
      return e;
    };
    Eigen::Matrix<double, 3, 7> analytic;
    residual(&analytic);
    int column = 0;
    for (std::size_t v = 0; v < 3; ++v) {
      const Value kept = values[v];
      for (int i = 0; i < dimension(types[v]); ++i, ++column) {
        constexpr double kStep = 1e-6;
        Delta delta{};
        delta[static_cast<std::size_t>(i)] = kStep;
        values[v] = moved(types[v], kept, delta.data());
        const Eigen::Vector3d after = residual(nullptr);
        delta[static_cast<std::size_t>(i)] = -kStep;
        values[v] = moved(types[v], kept, delta.data());
        const Eigen::Vector3d numeric = (after - residual(nullptr)) / (2.0 * kStep);
        values[v] = kept;
        REQUIRE((numeric - analytic.col(column)).norm() < 1e-7);
      }
    }
  }
}

TEST_CASE("The residual at the scalar's true value is that of the true motion", "[factor_graph]") {
  const SE2 motion(6.0, 0.3, 0.1);
  const double rate = 0.02;
  Graph graph;
  graph.poses = {SE2(), motion};
  graph.scalars = {rate};
  const RelativePose measured{PoseId(0), PoseId(1), at_true_rate(motion, -rate, kSeconds),
                              1e4 * Eigen::Matrix3d::Identity()};
  graph.turning_poses.push_back({measured, ScalarId(0), kSeconds});
  // To first order in the turn.
  CHECK(chi2(graph) < 5e-3);
  graph.scalars = {0.0};
  CHECK(chi2(graph) > 1.0);
}

TEST_CASE("A road with a gyro that is off ends where the batch solution is", "[smoother]") {
  std::mt19937_64 random(23);
  const Graph whole = with_gyro(random_road(random, 60), 0.02, random);
  Smoother smoother(exact());
  smoother.start_from(whole);
  for (int i = 0; i < 20; ++i) REQUIRE(smoother.update().ok);
  const Graph solved = smoother.graph();
  CHECK(std::abs(solved.scalars.front() - 0.02) < 0.01);

  // The same factors in a graph of their own, solved whole.
  FactorGraph batch;
  std::vector<VariableId> poses, points, scalars;
  for (const SE2& pose : whole.poses) poses.push_back(batch.add(pose));
  for (const Eigen::Vector2d& point : whole.points) points.push_back(batch.add(point));
  for (const double scalar : whole.scalars) scalars.push_back(batch.add(scalar));
  for (const PosePrior& f : whole.pose_priors)
    batch.add(prior(poses[index(f.pose)], f.mean, f.information));
  for (const PointObservation& f : whole.observations) {
    batch.add(observation(poses[index(f.pose)], points[index(f.point)], f.position, f.information));
  }
  for (const TurningPose& f : whole.turning_poses) {
    batch.add(turning(poses[index(f.motion.a)], poses[index(f.motion.b)], scalars[index(f.bias)],
                      f.motion.a_T_b, f.seconds, f.motion.information));
  }
  for (const ScalarPrior& f : whole.scalar_priors)
    batch.add(prior(scalars[index(f.scalar)], f.mean, f.information));
  for (const ScalarStep& f : whole.scalar_steps)
    batch.add(step(scalars[index(f.a)], scalars[index(f.b)], f.information));
  BatchParameters parameters;
  parameters.relative_decrease = 1e-15;
  REQUIRE(optimise(batch, parameters).ok);
  CHECK(std::abs(batch.chi2() - chi2(solved)) < 1e-6 * batch.chi2());
  for (std::size_t i = 0; i < scalars.size(); ++i)
    CHECK(std::abs(batch.value(scalars[i])[0] - solved.scalars[i]) < 1e-6);
  CHECK((pose2_of(batch.value(poses.back())).translation() - solved.poses.back().translation())
            .norm() < 1e-5);
}

TEST_CASE("Scalars are taken back with what was added since a checkpoint", "[smoother]") {
  std::mt19937_64 random(29);
  const Graph whole = with_gyro(random_road(random, 30), 0.01, random);
  Smoother smoother;
  smoother.start_from(whole);
  REQUIRE(smoother.update().ok);
  const Graph before = smoother.graph();
  smoother.checkpoint();
  const ScalarId next = smoother.add_scalar(0.0);
  smoother.add(ScalarStep{ScalarId(0), next, 1e6});
  smoother.add(ScalarPrior{next, 0.5, 1e6});
  REQUIRE(smoother.update().ok);
  CHECK(smoother.scalar(ScalarId(0)) != before.scalars.front());
  smoother.rollback();
  const Graph after = smoother.graph();
  CHECK(after.scalars == before.scalars);
  CHECK(after.scalar_priors.size() == before.scalar_priors.size());
  CHECK(after.scalar_steps.size() == before.scalar_steps.size());
  CHECK(difference(after, before) == 0.0);
}
