// The pose that holds a graph is another one than before.
#include "common/factor_graph/plane/smoother.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph::plane;

namespace {

Eigen::Matrix3d information(double per_m2, double per_rad2) {
  return Eigen::Vector3d(per_m2, per_m2, per_rad2).asDiagonal();
}

}  // namespace

TEST_CASE("A pose that does not hold the graph any more may be known by next to nothing",
          "[held]") {
  Smoother smoother;
  const PoseId far = smoother.add_pose({});
  const PoseId near = smoother.add_pose({100.0, 0.0, 0.1});
  smoother.hold(far, {});
  // Sigma of 300 m and 0.1 rad: a thousand kilometres of odometry.
  smoother.add(RelativePose{far, near, {100.0, 0.0, 0.1}, information(1e-5, 100.0)});
  REQUIRE(smoother.update().ok);

  smoother.hold(near, {100.0, 0.0, 0.1});
  const SmootherUpdate update = smoother.update();
  INFO(update.error);
  REQUIRE(update.ok);
  CHECK(smoother.pose(near).translation().isApprox(Eigen::Vector2d(100.0, 0.0), 1e-9));
  const auto covariance = smoother.joint_marginal({&far, 1}, {});
  REQUIRE(covariance);
  CHECK((*covariance)(0, 0) > 0.9e5);
}

TEST_CASE("The pose that is held is undone with the rest", "[held]") {
  Smoother smoother;
  const PoseId first = smoother.add_pose({});
  const PoseId second = smoother.add_pose({1.0, 0.0, 0.0});
  smoother.hold(first, {});
  smoother.add(RelativePose{first, second, {1.0, 0.0, 0.0}, information(100.0, 100.0)});
  REQUIRE(smoother.update().ok);

  smoother.checkpoint();
  smoother.hold(second, {5.0, 5.0, 0.0});
  REQUIRE(smoother.update().ok);
  CHECK(smoother.pose(first).translation().isApprox(Eigen::Vector2d(4.0, 5.0), 1e-6));
  smoother.rollback();
  REQUIRE(smoother.update().ok);
  CHECK(smoother.pose(first).translation().norm() < 1e-9);
  CHECK(smoother.pose(second).translation().isApprox(Eigen::Vector2d(1.0, 0.0), 1e-9));
  const auto covariance = smoother.joint_marginal({&second, 1}, {});
  REQUIRE(covariance);
  CHECK((*covariance)(0, 0) < 0.011);
}
