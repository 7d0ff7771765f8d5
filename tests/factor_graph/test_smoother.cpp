#include "common/factor_graph/plane/smoother.hpp"

#include <map>

#include "tests/catch.hpp"
#include "tests/factor_graph/batch_smoother.hpp"
#include "tests/factor_graph/random_graph.hpp"

using namespace understory;
using namespace understory::test;

namespace {

factor_graph::plane::Graph solved_whole(const factor_graph::plane::Graph& graph) {
  test::BatchSmootherParameters parameters;
  parameters.max_iterations = 50;
  parameters.converged_m = parameters.converged_rad = 1e-11;
  test::BatchSmoother batch(parameters);
  batch.graph() = graph;
  REQUIRE(batch.update().ok);
  return batch.graph();
}

/// Hands a graph over bit by bit: each step one pose with all that it measures.
class Feeder {
 public:
  Feeder(factor_graph::plane::Graph whole, factor_graph::plane::Smoother& smoother)
      : whole_(std::move(whole)), smoother_(smoother) {}

  bool done() const { return next_ == whole_.poses.size(); }
  void feed() {
    const factor_graph::plane::PoseId pose = smoother_.add_pose(whole_.poses[next_]);
    for (const factor_graph::plane::PosePrior& f : whole_.pose_priors) {
      if (f.pose == pose) smoother_.add(f);
    }
    for (const factor_graph::plane::RelativePose& f : whole_.relative_poses) {
      if (f.b == pose) smoother_.add(f);
    }
    for (factor_graph::plane::PointObservation f : whole_.observations) {
      if (f.pose != pose) continue;
      const auto [known, fresh] = points_.try_emplace(index(f.point));
      if (fresh) known->second = smoother_.add_point(whole_[f.point]);
      f.point = known->second;
      smoother_.add(f);
    }
    ++next_;
  }
  std::size_t next_ = 0;
  std::map<std::uint32_t, factor_graph::plane::PointId> points_;

 private:
  factor_graph::plane::Graph whole_;
  factor_graph::plane::Smoother& smoother_;
};

}  // namespace

TEST_CASE("Fed bit by bit, the smoother ends where the batch solution is", "[smoother]") {
  std::mt19937_64 random(11);
  for (int trial = 0; trial < 15; ++trial) {
    factor_graph::plane::Smoother smoother(test::exact());
    Feeder feeder(test::random_graph(random, 25, 20, 0.2), smoother);
    while (!feeder.done()) {
      feeder.feed();
      REQUIRE(smoother.update().ok);
    }
    for (int i = 0; i < 12; ++i) REQUIRE(smoother.update().ok);
    REQUIRE(difference(smoother.graph(), solved_whole(smoother.graph())) < 1e-8);
  }
}

TEST_CASE("With its usual thresholds the smoother stays within its tolerance", "[smoother]") {
  std::mt19937_64 random(12);
  for (int trial = 0; trial < 15; ++trial) {
    factor_graph::plane::Smoother smoother;
    Feeder feeder(test::random_graph(random, 25, 20, 0.2), smoother);
    while (!feeder.done()) {
      feeder.feed();
      REQUIRE(smoother.update().ok);
      const factor_graph::plane::Graph now = smoother.graph();
      REQUIRE(chi2(now) < 1.001 * chi2(solved_whole(now)) + 0.05);
    }
  }
}

TEST_CASE("Poses that see very many landmarks end where the batch solution is", "[smoother]") {
  std::mt19937_64 random(17);
  const factor_graph::plane::Graph whole = test::random_graph(random, 25, 120, 0.05);
  factor_graph::plane::Smoother smoother(test::exact());
  Feeder feeder(whole, smoother);
  while (!feeder.done()) {
    feeder.feed();
    // Undone and done again: what is not kept of a leaf is computed from what is there now.
    smoother.checkpoint();
    REQUIRE(smoother.update().ok);
    smoother.rollback();
    REQUIRE(smoother.update().ok);
  }
  for (int i = 0; i < 20; ++i) REQUIRE(smoother.update().ok);
  REQUIRE(difference(smoother.graph(), solved_whole(smoother.graph())) < 1e-8);
}

TEST_CASE("Along a road that never comes back the smoother stays with the batch solution",
          "[smoother]") {
  std::mt19937_64 random(17);
  factor_graph::plane::Smoother smoother;
  Feeder feeder(test::random_road(random, 300), smoother);
  while (!feeder.done()) {
    feeder.feed();
    REQUIRE(smoother.update().ok);
    if (feeder.next_ % 60 != 0) continue;
    const auto newest = static_cast<factor_graph::plane::PoseId>(feeder.next_ - 1);
    const factor_graph::plane::Graph exact_graph = solved_whole(smoother.graph());
    const auto covariance = smoother.joint_marginal({&newest, 1}, {});
    REQUIRE(covariance);
    const Eigen::Vector3d off =
        (exact_graph[newest].inverse() * smoother.pose(newest)).coordinates();
    INFO("pose " << index(newest) << ": " << off.transpose());
    // Three tenths of what the measurements leave open.
    REQUIRE(off.dot(covariance->inverse() * off) < 0.3 * 0.3);
  }
}

TEST_CASE("Any sequence of adding, changing and taking back equals the batch solution",
          "[smoother]") {
  std::mt19937_64 random(13);
  std::uniform_int_distribution<int> choose(0, 9);
  for (int trial = 0; trial < 15; ++trial) {
    factor_graph::plane::Smoother smoother(test::exact());
    Feeder feeder(test::random_graph(random, 20, 15, 0.2), smoother);
    feeder.feed();
    REQUIRE(smoother.update().ok);
    while (!feeder.done()) {
      smoother.checkpoint();
      const factor_graph::plane::Graph before = smoother.graph();
      const Feeder saved = feeder;
      const auto marginal = smoother.joint_marginal(
          std::vector<factor_graph::plane::PoseId>{factor_graph::plane::PoseId(0)}, {});
      feeder.feed();
      REQUIRE(smoother.update().ok);
      if (choose(random) < 4) {
        const std::uint32_t last = static_cast<std::uint32_t>(before.observations.size());
        factor_graph::plane::PointObservation changed =
            smoother.observation(factor_graph::plane::ObservationId(last / 2));
        changed.position.x() += 0.1;
        smoother.set(factor_graph::plane::ObservationId(last / 2), changed);
        REQUIRE(smoother.update().ok);
      }
      if (choose(random) < 5) {
        smoother.rollback();
        feeder.next_ = saved.next_;
        feeder.points_ = saved.points_;
        const factor_graph::plane::Graph after = smoother.graph();
        REQUIRE(after.poses.size() == before.poses.size());
        REQUIRE(after.points.size() == before.points.size());
        REQUIRE(after.observations.size() == before.observations.size());
        REQUIRE(difference(after, before) == 0.0);
        const auto again = smoother.joint_marginal(
            std::vector<factor_graph::plane::PoseId>{factor_graph::plane::PoseId(0)}, {});
        REQUIRE((*again - *marginal).norm() == 0.0);
      }
    }
    for (int i = 0; i < 12; ++i) REQUIRE(smoother.update().ok);
    REQUIRE(difference(smoother.graph(), solved_whole(smoother.graph())) < 1e-8);
  }
}

TEST_CASE("Joint covariances equal the dense inverse", "[smoother]") {
  std::mt19937_64 random(14);
  for (int trial = 0; trial < 10; ++trial) {
    factor_graph::plane::Smoother smoother(test::exact());
    Feeder feeder(test::random_graph(random, 20, 15, 0.2), smoother);
    while (!feeder.done()) {
      feeder.feed();
      REQUIRE(smoother.update().ok);
    }
    for (int i = 0; i < 12; ++i) REQUIRE(smoother.update().ok);
    test::BatchSmootherParameters parameters;
    parameters.max_iterations = 50;
    parameters.converged_m = parameters.converged_rad = 1e-11;
    test::BatchSmoother batch(parameters);
    batch.graph() = smoother.graph();
    REQUIRE(batch.update().ok);
    const std::vector<factor_graph::plane::PoseId> poses{factor_graph::plane::PoseId(3),
                                                         factor_graph::plane::PoseId(19),
                                                         factor_graph::plane::PoseId(0)};
    const std::vector<factor_graph::plane::PointId> points{factor_graph::plane::PointId(2),
                                                           factor_graph::plane::PointId(5)};
    const auto stated = smoother.joint_marginal(poses, points);
    const auto expected = batch.joint_marginal(poses, points);
    REQUIRE(stated);
    REQUIRE(expected);
    REQUIRE((*stated - *expected).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("A graph with a free gauge names its variables and can be mended", "[smoother]") {
  factor_graph::plane::Smoother smoother;
  const factor_graph::plane::PoseId a = smoother.add_pose(geometry::SE2(1, 2, 0.3));
  const factor_graph::plane::PoseId b = smoother.add_pose(geometry::SE2(2, 2, 0.3));
  smoother.add(
      factor_graph::plane::RelativePose{a, b, geometry::SE2(1, 0, 0), Eigen::Matrix3d::Identity()});
  const factor_graph::plane::SmootherUpdate update = smoother.update();
  REQUIRE_FALSE(update.ok);
  REQUIRE(update.error.find("pose ") != std::string::npos);
  REQUIRE_FALSE(smoother.joint_marginal(std::vector<factor_graph::plane::PoseId>{b}, {}));
  smoother.add(factor_graph::plane::PosePrior{a, geometry::SE2(), Eigen::Matrix3d::Identity()});
  REQUIRE(smoother.update().ok);
  REQUIRE(smoother.update().ok);
  REQUIRE(smoother.pose(b).coordinates().isApprox(Eigen::Vector3d(1, 0, 0), 1e-9));
}

TEST_CASE("A pose whose measurements go and that starts anew ends where the batch solution is",
          "[smoother]") {
  using namespace factor_graph::plane;
  std::mt19937_64 random(23);
  for (int trial = 0; trial < 12; ++trial) {
    const Graph whole = test::random_graph(random, 20, 20, 0.1);
    const Graph solution = solved_whole(whole);
    Smoother smoother(test::exact());
    smoother.start_from(whole);
    for (int i = 0; i < 12; ++i) REQUIRE(smoother.update().ok);
    const auto pose = PoseId(static_cast<std::uint32_t>(1 + random() % 19));
    CHECK_THROWS_AS(smoother.restart(pose, geometry::SE2()), std::invalid_argument);

    const auto set_measurements = [&](double share) {
      for (std::uint32_t i = 0; i < whole.relative_poses.size(); ++i) {
        RelativePose motion = whole.relative_poses[i];
        if (motion.a != pose && motion.b != pose) continue;
        motion.information *= share;
        smoother.set(MotionId(i), motion);
      }
      for (std::uint32_t i = 0; i < whole.observations.size(); ++i) {
        PointObservation seen = whole.observations[i];
        if (seen.pose != pose) continue;
        seen.information *= share;
        smoother.set(ObservationId(i), seen);
      }
    };
    const geometry::SE2 wrong(whole[pose].translation() + Eigen::Vector2d(0.3, -0.2),
                              whole[pose].theta() + 0.1);

    // Taken back, it is as if nothing had been.
    const Graph before = smoother.graph();
    smoother.checkpoint();
    set_measurements(0.0);
    REQUIRE(smoother.update().ok);
    smoother.restart(pose, wrong);
    CHECK(smoother.pose(pose).coordinates() == wrong.coordinates());
    set_measurements(1.0);
    REQUIRE(smoother.update().ok);
    smoother.rollback();
    CHECK(difference(smoother.graph(), before) == 0.0);

    // Within one update, or with one in between.
    smoother.checkpoint();
    set_measurements(0.0);
    if (trial % 2 == 0) REQUIRE(smoother.update().ok);
    smoother.restart(pose, wrong);
    set_measurements(1.0);
    for (int i = 0; i < 14; ++i) REQUIRE(smoother.update().ok);
    CHECK(difference(smoother.graph(), solution) < 1e-7);
    CHECK(smoother.joint_marginal({&pose, 1}, {}).has_value());
  }
}

TEST_CASE("A pose that is parked keeps its place and number, and takes no part", "[smoother]") {
  using namespace factor_graph::plane;
  std::mt19937_64 random(29);
  for (int trial = 0; trial < 10; ++trial) {
    const Graph whole = test::random_graph(random, 20, 20, 0.1);
    INFO("trial " << trial);
    Smoother smoother(test::exact());
    smoother.start_from(whole);
    for (int i = 0; i < 14; ++i) REQUIRE(smoother.update().ok);
    const Graph solution = smoother.graph();
    const auto pose = PoseId(static_cast<std::uint32_t>(whole.poses.size() / 2));
    CHECK_THROWS_AS(smoother.park(pose), std::invalid_argument);
    CHECK_THROWS_AS(smoother.unpark(pose), std::invalid_argument);

    smoother.checkpoint();
    const auto set_measurements = [&](double share) {
      for (std::uint32_t i = 0; i < whole.relative_poses.size(); ++i) {
        RelativePose motion = whole.relative_poses[i];
        if (motion.a != pose && motion.b != pose) continue;
        motion.information *= share;
        smoother.set(MotionId(i), motion);
      }
      for (std::uint32_t i = 0; i < whole.observations.size(); ++i) {
        PointObservation seen = whole.observations[i];
        if (seen.pose != pose) continue;
        seen.information *= share;
        smoother.set(ObservationId(i), seen);
      }
    };
    set_measurements(0.0);
    smoother.park(pose);
    CHECK(smoother.pose(pose).coordinates() == solution[pose].coordinates());
    CHECK_FALSE(smoother.joint_marginal({&pose, 1}, {}).has_value());
    const std::vector<PoseId> both{pose, PoseId(0)};
    CHECK(smoother.marginals(both, {}).poses[0].isZero(0.0));
    CHECK(smoother.graph().poses.size() == whole.poses.size());
    if (trial % 2 == 0) REQUIRE(smoother.update().ok);

    // Taken back, it is as if nothing had been.
    smoother.rollback();
    CHECK(difference(smoother.graph(), solution) == 0.0);
    CHECK(smoother.joint_marginal({&pose, 1}, {}).has_value());

    // Back in its place, also after others took its room.
    smoother.checkpoint();
    set_measurements(0.0);
    smoother.park(pose);
    REQUIRE(smoother.update().ok);
    smoother.checkpoint();
    const PoseId other = smoother.add_pose({1.0, 2.0, 3.0});
    smoother.unpark(pose);
    set_measurements(1.0);
    for (int i = 0; i < 14; ++i) REQUIRE(smoother.update().ok);
    CHECK(smoother.pose(other).coordinates() == geometry::SE2(1.0, 2.0, 3.0).coordinates());
    CHECK(smoother.joint_marginal({&pose, 1}, {}).has_value());
    Graph now = smoother.graph();
    now.poses.pop_back();
    CHECK(difference(now, solution) < 1e-7);
  }
}
