// Loop closures that come from outside.
#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "services/geoslam_mapper/smoothing/closures.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;
using Status = model::LoopResult::Status;

namespace {

constexpr int kNodes = 200;

/// A ring of nodes whose odometry drifted: what is known of it is `stated` times its noise.
struct Ring {
  GlobalMap map{SmoothingMapperParameters{}};
  std::vector<NodeIndex> nodes;
  std::vector<geometry::SE2> truth;
  Closures closures;
  std::mt19937_64 random;

  explicit Ring(std::uint64_t seed, double stated = 1.0, double yaw_bias_rad = 0.0) : random(seed) {
    const geometry::SE2 step = geometry::SE2::Exp({10.0, 0.0, 2.0 * std::numbers::pi / kNodes});
    const Eigen::Vector3d sigma(0.05, 0.02, 2e-3);
    const Eigen::Matrix3d covariance = sigma.array().square().matrix().asDiagonal();
    truth.emplace_back();
    nodes.push_back(map.graph.add_node(truth.back(), false, true));
    for (int i = 1; i < kNodes; ++i) {
      truth.push_back(truth.back() * step);
      const Eigen::Vector3d noise = noise_of(covariance) + Eigen::Vector3d(0.0, 0.0, yaw_bias_rad);
      const geometry::SE2 measured = step * geometry::SE2::Exp(noise);
      nodes.push_back(map.graph.add_node(map.graph.pose(nodes.back()) * measured, false));
      CentreMotion motion;
      motion.from = nodes[static_cast<std::size_t>(i) - 1];
      motion.from_T_to = {measured, stated * stated * covariance};
      map.graph.add_motion(motion, nodes.back());
    }
    REQUIRE(map.graph.solve().ok);
  }
  Eigen::Vector3d noise_of(const Eigen::Matrix3d& covariance) {
    std::normal_distribution<double> normal;
    const Eigen::Vector3d unit(normal(random), normal(random), normal(random));
    return covariance.llt().matrixL() * unit;
  }
  /// Between two nodes, true but for its noise.
  model::LoopClosure closure(std::uint64_t id, int a, int b) {
    model::LoopClosure result;
    result.id = id;
    result.source = "test";
    result.from_T_to.covariance = Eigen::Vector3d(1e-3, 1e-3, 1e-6).asDiagonal();
    result.from_T_to.mean = truth[static_cast<std::size_t>(a)].inverse() *
                            truth[static_cast<std::size_t>(b)] *
                            geometry::SE2::Exp(noise_of(result.from_T_to.covariance));
    return result;
  }
  Status take(const model::LoopClosure& closure, int a, int b) {
    return closures
        .take(closure, {nodes[static_cast<std::size_t>(a)], {}},
              {nodes[static_cast<std::size_t>(b)], {}}, map)
        .status;
  }
  double worst_m() const {
    double worst = 0.0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const geometry::SE2 pose = map.graph.pose(nodes[i]);
      worst = std::max(worst, (pose.translation() - truth[i].translation()).norm());
    }
    return worst;
  }
};

}  // namespace

TEST_CASE("A closure that the graph expects counts at once, and goes when revoked", "[closures]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    Ring ring(seed);
    const double before_m = ring.worst_m();
    std::vector<geometry::SE2> before;
    for (const NodeIndex node : ring.nodes) before.push_back(ring.map.graph.pose(node));

    const model::LoopClosure closure = ring.closure(7, 0, kNodes - 1);
    CHECK(ring.take(closure, 0, kNodes - 1) == Status::kAccepted);
    CHECK(ring.take(closure, 0, kNodes - 1) == Status::kAccepted);  // Said again.
    CHECK(ring.map.graph.closure_chi2(7) < 31.0);
    const geometry::SE2 end = ring.map.graph.pose(ring.nodes.back());
    CHECK((end.translation() - ring.truth.back().translation()).norm() < 0.15);
    CHECK(ring.worst_m() < std::max(1.0, before_m));

    CHECK(ring.closures.revoke(7, ring.map).status == Status::kRevoked);
    CHECK(ring.closures.revoke(7, ring.map).status == Status::kRefused);
    for (std::size_t i = 0; i < before.size(); ++i) {
      const geometry::SE2 now = ring.map.graph.pose(ring.nodes[i]);
      CHECK((now.translation() - before[i].translation()).norm() < 0.01);
    }
  }
}

TEST_CASE("A closure against what the graph knows waits for others that agree", "[closures]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    // A bias of the gyro that nobody stated.
    Ring ring(seed, 0.5, 1.5e-3);
    const double before_m = ring.worst_m();
    REQUIRE(before_m > 20.0);
    CHECK(ring.take(ring.closure(1, 0, kNodes - 1), 0, kNodes - 1) == Status::kWaiting);
    model::LoopClosure wrong = ring.closure(2, 20, kNodes - 20);
    wrong.from_T_to.mean = wrong.from_T_to.mean * geometry::SE2(80.0, -40.0, 2.0);
    CHECK(ring.take(wrong, 20, kNodes - 20) == Status::kWaiting);
    CHECK(ring.take(ring.closure(3, 3, kNodes - 4), 3, kNodes - 4) == Status::kWaiting);
    // These two see the landmarks of the first one.
    CHECK(ring.take(ring.closure(5, 1, kNodes - 2), 1, kNodes - 2) == Status::kWaiting);
    CHECK(ring.take(ring.closure(6, 1, kNodes - 8), 1, kNodes - 8) == Status::kWaiting);
    CHECK(ring.worst_m() == before_m);
    CHECK(ring.take(ring.closure(4, 6, kNodes - 7), 6, kNodes - 7) == Status::kAccepted);
    CHECK(ring.map.graph.has_closure(1));
    CHECK(ring.map.graph.has_closure(3));
    CHECK_FALSE(ring.map.graph.has_closure(2));
    CHECK(ring.worst_m() < 0.35 * before_m);
    CHECK(ring.closures.revoke(2, ring.map).status == Status::kRevoked);  // It still waited.
  }
}

TEST_CASE("A person's closure counts where the rest of the graph allows it", "[closures]") {
  Ring ring(9, 0.3, 2e-3);
  model::LoopClosure closure = ring.closure(1, 0, kNodes - 1);
  closure.source = "manual";
  CHECK(ring.take(closure, 0, kNodes - 1) == Status::kAccepted);
  CHECK(ring.worst_m() < 12.0);
  closure.id = 2;
  CHECK(ring.take(closure, 5, 5) == Status::kRefused);
}

TEST_CASE("Wrong closures do not agree with each other by chance", "[closures]") {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> any(0, kNodes - 1);
  std::uniform_real_distribution<double> metres(-150.0, 150.0);
  std::uniform_real_distribution<double> heading(-3.1, 3.1);
  Ring ring(4);
  int accepted = 0;
  for (std::uint64_t id = 1; id <= 400; ++id) {
    const int a = any(random);
    const int b = (a + 20 + any(random) % (kNodes - 40)) % kNodes;
    model::LoopClosure wrong = ring.closure(id, a, b);
    wrong.from_T_to.mean = geometry::SE2(metres(random), metres(random), heading(random));
    if (ring.take(wrong, a, b) == Status::kAccepted) ++accepted;
  }
  CHECK(accepted == 0);
}

TEST_CASE("Closures follow a node that becomes part of another", "[closures]") {
  Ring ring(6, 0.3, 2e-3);
  CHECK(ring.take(ring.closure(1, 0, kNodes - 1), 0, kNodes - 1) == Status::kWaiting);
  CHECK(ring.take(ring.closure(2, 3, kNodes - 4), 3, kNodes - 4) == Status::kWaiting);

  // The nodes of the first closure's end and before it become one.
  ring.map.graph.checkpoint();
  std::vector<NodeIndex> stretch(ring.nodes.end() - 7, ring.nodes.end() - 1);
  const NodeIndex last = ring.map.graph.add_node(ring.map.graph.pose(ring.nodes.back()), false);
  CentreMotion motion;
  motion.from = ring.nodes.back();
  motion.from_T_to = {{}, 1e-8 * Eigen::Matrix3d::Identity()};
  ring.map.graph.add_motion(motion, last);
  REQUIRE(ring.map.graph.solve().ok);
  const std::vector<Retirement> retired = ring.map.graph.condense(stretch);
  REQUIRE_FALSE(retired.empty());
  REQUIRE(ring.map.graph.solve().ok);
  ring.closures.hand_over(retired);
  CHECK(ring.take(ring.closure(4, 6, kNodes - 12), 6, kNodes - 12) == Status::kAccepted);
  CHECK(ring.map.graph.has_closure(1));
  CHECK(ring.map.graph.has_closure(2));
}

TEST_CASE("A graph that states a tenth of its noise yields to witnesses beyond doubt",
          "[closures]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    Ring ring(seed, 0.1, 1.5e-3);
    const double before_m = ring.worst_m();
    int accepted = 0;
    int sent = 0;
    for (int i = 0; i <= 20; i += 2, ++sent) {
      const auto id = static_cast<std::uint64_t>(1 + i);
      model::LoopClosure closure = ring.closure(id, i, kNodes - 1 - i);
      closure.log10_false_alarm = -40.0;
      (void)ring.take(closure, i, kNodes - 1 - i);
    }
    for (int i = 0; i <= 20; i += 2)
      if (ring.map.graph.has_closure(static_cast<std::uint64_t>(1 + i))) ++accepted;
    CAPTURE(seed, before_m, ring.worst_m());
    CHECK(accepted == sent);
    CHECK(ring.worst_m() < 0.35 * before_m);
  }
}

TEST_CASE("Wrong closures of neighbouring windows agree, and are one witness", "[closures]") {
  // A place that looks like another one: every window of 20 m around it is off by the same motion.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> metres(-80.0, 80.0);
  std::uniform_real_distribution<double> heading(-3.1, 3.1);
  std::uniform_int_distribution<int> any(0, kNodes - 60);
  int accepted = 0;
  int wrong = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Ring ring(seed, 0.3);
    for (int group = 0; group < 20; ++group) {
      const int a = any(random);
      const int b = a + 40;
      const geometry::SE2 off(metres(random), metres(random), heading(random));
      // The vehicle's own frame at both ends moves along: the landmarks stay where they are.
      const geometry::SE2 a_T_b = ring.truth[static_cast<std::size_t>(a)].inverse() *
                                  ring.truth[static_cast<std::size_t>(b)] * off;
      for (int i = 0; i < 5; ++i, ++wrong) {
        model::LoopClosure closure = ring.closure(static_cast<std::uint64_t>(1 + wrong), a, b);
        closure.log10_false_alarm = -10.0;
        const double along_m = 4.0 * i;
        closure.from_T_to.mean =
            geometry::SE2(-along_m, 0.0, 0.0) * a_T_b * geometry::SE2(along_m, 0.0, 0.0);
        const ClosureEnd from{ring.nodes[static_cast<std::size_t>(a)],
                              {geometry::SE2(along_m, 0.0, 0.0), Eigen::Matrix3d::Zero()}};
        const ClosureEnd to{ring.nodes[static_cast<std::size_t>(b)],
                            {geometry::SE2(along_m, 0.0, 0.0), Eigen::Matrix3d::Zero()}};
        if (ring.closures.take(closure, from, to, ring.map).status == Status::kAccepted) ++accepted;
      }
    }
  }
  INFO(wrong << " wrong closures");
  CHECK(wrong == 500);
  CHECK(accepted == 0);
}

TEST_CASE("The graph yields once to nested loops, and no further than odometry can be wrong",
          "[closures]") {
  // A road there and back: each closure lies around those before it.
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    Ring ring(seed, 0.1, 1.5e-3);
    std::uint64_t id = 0;
    int accepted = 0;
    for (int i = kNodes / 2 - 10; i >= 0; i -= 2) {
      model::LoopClosure closure = ring.closure(++id, i, kNodes - 1 - i);
      closure.log10_false_alarm = -12.0;
      (void)ring.take(closure, i, kNodes - 1 - i);
    }
    for (std::uint64_t one = 1; one <= id; ++one) accepted += ring.map.graph.has_closure(one);
    CAPTURE(seed, accepted, id);
    CHECK(accepted >= static_cast<int>(id) - 6);

    // The graph still tells what is far off: 20 nodes of path are known to better than 10 m.
    const auto known = ring.map.graph.relative(ring.nodes[20], ring.nodes[40]);
    REQUIRE(known);
    CHECK(known->covariance.topLeftCorner<2, 2>().trace() < 100.0);
    int wrong = 0;
    for (int k = 0; k < 8; ++k) {
      const int a = 10 + 7 * k, b = 100 + 7 * k;
      model::LoopClosure closure = ring.closure(1000 + static_cast<std::uint64_t>(k), a, b);
      closure.log10_false_alarm = -12.0;
      const geometry::SE2 shifted(
          ring.truth[static_cast<std::size_t>(b)].translation() + Eigen::Vector2d(300.0, -200.0),
          ring.truth[static_cast<std::size_t>(b)].theta());
      closure.from_T_to.mean = ring.truth[static_cast<std::size_t>(a)].inverse() * shifted;
      wrong += ring.take(closure, a, b) == Status::kAccepted;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("A closure that waits counts when the graph has been corrected", "[closures]") {
  Ring ring(3, 0.1, 1.5e-3);
  // A weak one, and a person's around it.
  model::LoopClosure weak = ring.closure(1, 3, kNodes - 4);
  weak.log10_false_alarm = -1.0;
  CHECK(ring.take(weak, 3, kNodes - 4) == Status::kWaiting);
  model::LoopClosure person = ring.closure(2, 0, kNodes - 1);
  person.source = "manual";
  CHECK(ring.take(person, 0, kNodes - 1) == Status::kAccepted);
  CHECK(ring.map.graph.has_closure(1));
}
