// Covariances of many variables in one pass, against those of one variable at a time.
#include <Eigen/Dense>
#include <random>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/random_graph.hpp"

using namespace understory;
namespace plane = factor_graph::plane;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace {

/// A random choice of some of `count` numbers, in random order.
template <typename Id>
std::vector<Id> some_of(std::uint32_t count, double share, std::mt19937_64& random) {
  std::vector<Id> result;
  std::bernoulli_distribution chosen(share);
  for (std::uint32_t i = 0; i < count; ++i)
    if (chosen(random)) result.push_back(Id(i));
  std::shuffle(result.begin(), result.end(), random);
  return result;
}

void check_against_one_at_a_time(const plane::Smoother& smoother,
                                 const std::vector<plane::PoseId>& poses,
                                 const std::vector<plane::PointId>& points) {
  const plane::Marginals together = smoother.marginals(poses, points);
  REQUIRE(together.poses.size() == poses.size());
  REQUIRE(together.points.size() == points.size());

  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto alone = smoother.joint_marginal({&poses[i], 1}, {});
    const Eigen::Matrix3d expected = alone ? Eigen::Matrix3d(*alone) : Eigen::Matrix3d::Zero();
    REQUIRE((together.poses[i] - expected).norm() <= 1e-9 * expected.norm());
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto alone = smoother.joint_marginal({}, {&points[i], 1});
    const Eigen::Matrix2d expected = alone ? Eigen::Matrix2d(*alone) : Eigen::Matrix2d::Zero();
    REQUIRE((together.points[i] - expected).norm() <= 1e-9 * expected.norm());
  }
}

}  // namespace

TEST_CASE("Marginals of any choice of variables are those of each alone", "[marginals]") {
  std::mt19937_64 random(31);
  for (int trial = 0; trial < 30; ++trial) {
    const auto poses = static_cast<std::uint32_t>(2 + random() % 60);
    const auto points = static_cast<std::uint32_t>(1 + random() % 40);
    const bool is_road = trial % 3 == 0;
    const plane::Graph graph = is_road ? test::random_road(random, poses)
                                       : test::random_graph(random, static_cast<int>(poses),
                                                            static_cast<int>(points), 0.1);

    plane::Smoother smoother;
    smoother.start_from(graph);
    REQUIRE(smoother.update().ok);
    const auto point_count = static_cast<std::uint32_t>(graph.points.size());
    for (const double share : {1.0, 0.3, 0.05, 0.0}) {
      check_against_one_at_a_time(smoother, some_of<plane::PoseId>(poses, share, random),
                                  some_of<plane::PointId>(point_count, share, random));
    }
  }
}

TEST_CASE("What the measurements leave open has no marginal, nor what hangs on it", "[marginals]") {
  plane::Smoother smoother;
  const plane::PoseId first = smoother.add_pose({});
  const plane::PoseId second = smoother.add_pose({1.0, 0.0, 0.0});
  const plane::PointId seen = smoother.add_point({2.0, 1.0});
  const plane::PointId unseen = smoother.add_point({5.0, 5.0});
  smoother.add(plane::RelativePose{first, second, {1.0, 0.0, 0.0}, Eigen::Matrix3d::Identity()});
  smoother.add(plane::PointObservation{second, seen, {1.0, 1.0}, Eigen::Matrix2d::Identity()});

  SECTION("nothing holds the graph") {
    REQUIRE_FALSE(smoother.update().ok);
    const plane::Marginals found =
        smoother.marginals(std::vector{first, second}, std::vector{seen});
    CHECK(found.poses[0].isZero(0.0));
    CHECK(found.poses[1].isZero(0.0));
    CHECK(found.points[0].isZero(0.0));
  }

  SECTION("a point without a measurement") {
    smoother.add(plane::PosePrior{first, {}, 4.0 * Eigen::Matrix3d::Identity()});
    REQUIRE(smoother.update().ok);
    const plane::Marginals found =
        smoother.marginals(std::vector{first}, std::vector{unseen, seen});
    CHECK((found.poses[0] - 0.25 * Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK(found.points[0].isZero(0.0));
    CHECK(found.points[1].trace() > 2.0);
  }
}

TEST_CASE("Marginals of poses in space are those of each alone", "[marginals]") {
  using namespace factor_graph::graph;
  std::mt19937_64 random(32);
  std::normal_distribution<double> normal;
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  std::vector<VariableId> poses;
  Pose3 at;
  for (int k = 0; k < 40; ++k) {
    Pose3 step;
    step.translation = {1.0 + 0.1 * normal(random), 0.1 * normal(random), 0.1 * normal(random)};
    step.rotation = Eigen::AngleAxisd(0.2 * normal(random), Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(0.2 * normal(random), Eigen::Vector3d::UnitX());
    const Matrix6 information = 50.0 * Matrix6::Identity();
    if (k > 0) at = at * step;
    poses.push_back(smoother.add_variable(at));
    if (k == 0) smoother.add(prior(poses[0], Pose3{}, Matrix6(1e3 * Matrix6::Identity())));
    if (k > 0) smoother.add(relative(poses[poses.size() - 2], poses.back(), step, information));
    if (k > 10) smoother.add(relative(poses[0], poses.back(), at, Matrix6(Matrix6::Identity())));
  }
  REQUIRE(smoother.update().ok);

  const std::vector<Eigen::MatrixXd> together = smoother.covariances(poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto alone = smoother.joint_covariance({&poses[i], 1});
    REQUIRE(alone);
    REQUIRE((together[i] - *alone).norm() <= 1e-9 * alone->norm());
  }
}
