// Motions measured by an instrument that is off by a scalar of the graph.
#include <random>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/graph_copy.hpp"
#include "tests/factor_graph/random_graph.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using namespace understory::test;

namespace {

constexpr double kSeconds = 0.8;

/// The road's graph, its motions turned too far by a rate that walks; a scalar for five of them.
factor_graph::plane::Graph with_gyro(factor_graph::plane::Graph graph, double rate,
                                     std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < graph.relative_poses.size(); ++k) {
    if (k % 5 == 0) {
      const factor_graph::plane::ScalarId id{static_cast<std::uint32_t>(graph.scalars.size())};
      if (graph.scalars.empty()) {
        graph.scalar_priors.push_back({id, 0.0, 1e4});
      } else {
        graph.scalar_steps.push_back({factor_graph::plane::ScalarId(index(id) - 1), id, 1e6});
      }
      graph.scalars.push_back(0.0);
    }
    rate += 1e-3 * normal(random);
    factor_graph::plane::RelativePose motion = graph.relative_poses[k];
    // at_true_rate takes a rate out; this puts it in.
    motion.a_T_b = factor_graph::plane::at_true_rate(motion.a_T_b, -rate, kSeconds);
    graph.biased_relative_poses.push_back(
        {motion,
         factor_graph::plane::ScalarId(static_cast<std::uint32_t>(graph.scalars.size() - 1)),
         kSeconds});
  }
  graph.relative_poses.clear();
  return graph;
}

}  // namespace

TEST_CASE("A biased motion's derivative equals the numerical one", "[factor_graph]") {
  std::mt19937_64 random(5);
  const std::array<VariableType, 3> types{VariableType::kPose2, VariableType::kPose2,
                                          VariableType::kScalar};
  for (int trial = 0; trial < 20; ++trial) {
    const geometry::SE2 a = geometry::SE2::Exp(test::random_tangent(random, 5.0, 1.0));
    const geometry::SE2 measured = geometry::SE2::Exp(test::random_tangent(random, 3.0, 0.5));
    const geometry::SE2 b =
        a * measured * geometry::SE2::Exp(test::random_tangent(random, 0.2, 0.1));
    std::array<Value, 3> values{value_of(a), value_of(b), value_of(0.1 * trial)};
    const Factor factor = biased_relative(VariableId(0), VariableId(1), VariableId(2), measured,
                                          kSeconds, Eigen::Matrix3d::Identity());
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
        REQUIRE((numeric - analytic.col(column)).norm() < 5e-9);
      }
    }
  }
}

TEST_CASE("The residual at the scalar's true value is that of the true motion", "[factor_graph]") {
  const geometry::SE2 motion(6.0, 0.3, 0.1);
  const double rate = 0.02;
  factor_graph::plane::Graph graph;
  graph.poses = {geometry::SE2(), motion};
  graph.scalars = {rate};
  const factor_graph::plane::RelativePose measured{
      factor_graph::plane::PoseId(0), factor_graph::plane::PoseId(1),
      factor_graph::plane::at_true_rate(motion, -rate, kSeconds),
      1e4 * Eigen::Matrix3d::Identity()};
  graph.biased_relative_poses.push_back({measured, factor_graph::plane::ScalarId(0), kSeconds});
  // To first order in the turn.
  CHECK(chi2(graph) < 5e-3);
  graph.scalars = {0.0};
  CHECK(chi2(graph) > 1.0);
}

TEST_CASE("A road with a gyro that is off ends where the batch solution is", "[smoother]") {
  std::mt19937_64 random(23);
  const factor_graph::plane::Graph whole = with_gyro(test::random_road(random, 60), 0.02, random);
  factor_graph::plane::Smoother smoother(test::exact());
  smoother.start_from(whole);
  for (int i = 0; i < 20; ++i) REQUIRE(smoother.update().ok);
  const factor_graph::plane::Graph solved = smoother.graph();
  CHECK(std::abs(solved.scalars.front() - 0.02) < 1e-3);

  // The same factors in a graph of their own, solved whole.
  FactorGraph batch;
  std::vector<VariableId> poses, points, scalars;
  for (const geometry::SE2& pose : whole.poses) poses.push_back(batch.add(pose));
  for (const Eigen::Vector2d& point : whole.points) points.push_back(batch.add(point));
  for (const double scalar : whole.scalars) scalars.push_back(batch.add(scalar));
  for (const factor_graph::plane::PosePrior& f : whole.pose_priors)
    batch.add(prior(poses[index(f.pose)], f.mean, f.information));
  for (const factor_graph::plane::PointObservation& f : whole.observations) {
    batch.add(observation(poses[index(f.pose)], points[index(f.point)], f.position, f.information));
  }
  for (const factor_graph::plane::BiasedRelativePose& f : whole.biased_relative_poses) {
    batch.add(biased_relative(poses[index(f.motion.a)], poses[index(f.motion.b)],
                              scalars[index(f.bias)], f.motion.a_T_b, f.seconds,
                              f.motion.information));
  }
  for (const factor_graph::plane::ScalarPrior& f : whole.scalar_priors)
    batch.add(prior(scalars[index(f.scalar)], f.mean, f.information));
  for (const factor_graph::plane::ScalarStep& f : whole.scalar_steps)
    batch.add(step(scalars[index(f.a)], scalars[index(f.b)], f.information));
  factor_graph::batch::BatchParameters parameters;
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
  const factor_graph::plane::Graph whole = with_gyro(test::random_road(random, 30), 0.01, random);
  factor_graph::plane::Smoother smoother;
  smoother.start_from(whole);
  REQUIRE(smoother.update().ok);
  const factor_graph::plane::Graph before = smoother.graph();
  smoother.checkpoint();
  const factor_graph::plane::ScalarId next = smoother.add_scalar(0.0);
  smoother.add(factor_graph::plane::ScalarStep{factor_graph::plane::ScalarId(0), next, 1e6});
  smoother.add(factor_graph::plane::ScalarPrior{next, 0.5, 1e6});
  REQUIRE(smoother.update().ok);
  CHECK(smoother.scalar(factor_graph::plane::ScalarId(0)) != before.scalars.front());
  smoother.rollback();
  const factor_graph::plane::Graph after = smoother.graph();
  CHECK(after.scalars == before.scalars);
  CHECK(after.scalar_priors.size() == before.scalar_priors.size());
  CHECK(after.scalar_steps.size() == before.scalar_steps.size());
  CHECK(difference(after, before) == 0.0);
}
