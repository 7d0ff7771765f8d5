// Nodes out of the solved graph.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr int kStretches = 40;
constexpr int kPerStretch = 4;

/// A way of condensed nodes from a fixed one to an uncondensed one, with ties to the second next,
/// and crossed by itself where `crossings` says so.
struct Way {
  PoseGraph graph{SmoothingMapperParameters{}};
  std::vector<NodeIndex> nodes;  ///< Condensed ones.
  NodeIndex last = 0;
  std::mt19937_64 random;

  Way(std::uint64_t seed, bool crosses) : random(seed) {
    const geometry::SE2 step = geometry::SE2::Exp({5.0, 0.0, 0.03});
    const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-3, 4e-4, 1e-6).asDiagonal();
    std::vector<NodeIndex> fine{graph.add_node({}, false, true)};
    for (int i = 1; i < kStretches * kPerStretch + 8; ++i) {
      const geometry::SE2 measured = step * noise(covariance);
      fine.push_back(graph.add_node(graph.pose(fine.back()) * measured, false));
      add(fine[fine.size() - 2], fine.back(), {measured, covariance});
      if (fine.size() > 3)
        add(fine[fine.size() - 3], fine.back(), {step * step * noise(covariance), covariance});
      const auto back = static_cast<std::size_t>(60);
      if (crosses && i % 20 == 0 && fine.size() > back) {
        geometry::SE2 far;
        for (std::size_t k = 0; k < back; ++k) far = far * step;
        add(fine[fine.size() - 1 - back], fine.back(), {far * noise(covariance), covariance});
      }
    }
    settle();
    for (int s = 0; s < kStretches; ++s) {
      const auto first = fine.begin() + 2 + s * kPerStretch;
      const std::vector<NodeIndex> stretch(first, first + kPerStretch);
      const auto retired = graph.condense(stretch);
      REQUIRE_FALSE(retired.empty());
      nodes.push_back(retired.front().into);
    }
    last = fine.back();
    settle();
  }
  geometry::SE2 noise(const Eigen::Matrix3d& covariance) {
    std::normal_distribution<double> normal;
    const Eigen::Vector3d unit(normal(random), normal(random), normal(random));
    return geometry::SE2::Exp(covariance.llt().matrixL() * unit);
  }
  void add(NodeIndex from, NodeIndex to, const geometry::SE2WithCovariance& motion) {
    CentreMotion one;
    one.from = from;
    one.from_T_to = motion;
    graph.add_motion(one, to);
  }
  void settle() {
    for (int i = 0; i < 6; ++i) REQUIRE(graph.solve().ok);
  }
  std::vector<geometry::SE2> poses() const {
    std::vector<geometry::SE2> result;
    for (const NodeIndex node : nodes) result.push_back(graph.pose(node));
    result.push_back(graph.pose(last));
    return result;
  }
};

double apart(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  double worst_m = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst_m = std::max(worst_m, (a[i].translation() - b[i].translation()).norm());
  return worst_m;
}

}  // namespace

TEST_CASE("Frozen nodes leave the rest where it was, and as sure", "[freezing]") {
  for (const bool crosses : {false, true}) {
    for (const std::uint64_t seed : {1, 2, 3, 4}) {
      Way way(seed, crosses);
      INFO("crosses " << crosses << ", seed " << seed);
      const auto before = way.poses();
      const Eigen::Matrix3d covariance = way.graph.marginal(way.last).covariance;
      const double sigma_m = std::sqrt(covariance.topLeftCorner<2, 2>().trace());

      const std::vector<NodeIndex> middle(way.nodes.begin() + 8, way.nodes.begin() + 32);
      way.graph.checkpoint();
      REQUIRE(way.graph.freeze(middle));
      CHECK(way.graph.frozen_count() == middle.size());
      way.settle();
      CHECK(apart(before, way.poses()) < 0.02 * sigma_m);
      CHECK(way.graph.marginal(way.last).covariance.isApprox(covariance, 0.01));

      // In two steps, and all back.
      const std::vector<NodeIndex> more(way.nodes.begin() + 5, way.nodes.begin() + 8);
      REQUIRE(way.graph.freeze(more));
      way.settle();
      CHECK(way.graph.marginal(way.last).covariance.isApprox(covariance, 0.01));
      way.graph.thaw(std::vector<NodeIndex>(way.nodes.begin() + 12, way.nodes.begin() + 16));
      way.settle();
      CHECK(apart(before, way.poses()) < 0.02 * sigma_m);
      CHECK(way.graph.marginal(way.nodes[14]).covariance.trace() > 0.0);
      way.graph.thaw(way.nodes);
      CHECK(way.graph.frozen_count() == 0);
      way.settle();
      CHECK(apart(before, way.poses()) < 0.01 * sigma_m);
      CHECK(way.graph.marginal(way.last).covariance.isApprox(covariance, 0.01));
    }
  }
}

TEST_CASE("A closure moves what is frozen as if it was not", "[freezing]") {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Way frozen(seed, false);
    Way free(seed, false);
    const std::vector<NodeIndex> middle(frozen.nodes.begin() + 8, frozen.nodes.begin() + 32);
    REQUIRE(frozen.graph.freeze(middle));
    frozen.settle();
    geometry::SE2WithCovariance closure;
    closure.mean = frozen.graph.pose(frozen.nodes[2]).inverse() * frozen.graph.pose(frozen.last) *
                   geometry::SE2(1.5, -1.0, 0.04);
    closure.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal();
    for (Way* way : {&frozen, &free}) {
      way->graph.add_closure(1, way->nodes[2], way->last, closure);
      way->settle();
    }
    // Another node holds the frozen graph: what lies between is the same.
    const auto between = [](const Way& way) {
      return way.graph.pose(way.nodes[2]).inverse() * way.graph.pose(way.last);
    };
    CHECK((between(frozen).translation() - between(free).translation()).norm() < 0.05);

    frozen.graph.unfreeze();
    frozen.settle();
    free.settle();
    CHECK(apart(frozen.poses(), free.poses()) < 0.02);
  }
}

/// The origin, and what is beside it, closed; with the first stretches.
std::vector<NodeIndex> from_origin(Way& way, std::ptrdiff_t stretches) {
  const NodeIndex origin = *way.graph.origin();
  std::vector<NodeIndex> going{origin, origin + 1};
  for (const NodeIndex node : going) way.graph.close(node);
  going.insert(going.end(), way.nodes.begin(), way.nodes.begin() + stretches);
  return going;
}

TEST_CASE("Where all behind is frozen, another node holds the graph", "[freezing]") {
  for (const bool crosses : {false, true}) {
    Way way(9, crosses);
    INFO("crosses " << crosses);
    const auto before = way.poses();
    const Eigen::Matrix3d exact = way.graph.marginal(way.last).covariance;
    const auto going = from_origin(way, 20);
    way.graph.checkpoint();
    REQUIRE(way.graph.freeze(going));
    way.settle();
    CHECK(way.graph.is_frozen(*way.graph.origin() + 1));
    CHECK_FALSE(way.graph.is_frozen(*way.graph.origin()));
    CHECK(apart(before, way.poses()) < 1e-3);
    const Eigen::Matrix3d covariance = way.graph.marginal(way.last).covariance;
    CHECK(covariance.isApprox(exact, 0.02));
    // Of many at once: what crosses may make it larger, never less.
    const Eigen::Matrix3d at_once = way.graph.covariances(std::vector<NodeIndex>{way.last})[0];
    CHECK(at_once.trace() > 0.999 * covariance.trace());
    CHECK(at_once.trace() < (crosses ? 2.5 : 1.001) * covariance.trace());

    // It goes on from there, and once more; then all of it is there again.
    const std::vector<NodeIndex> more(way.nodes.begin() + 20, way.nodes.begin() + 30);
    REQUIRE(way.graph.freeze(more));
    way.settle();
    CHECK(apart(before, way.poses()) < 1e-3);
    CHECK(way.graph.marginal(way.last).covariance.isApprox(exact, 0.02));
    way.graph.unfreeze();
    way.settle();
    CHECK(way.graph.frozen_count() == 0);
    CHECK(apart(before, way.poses()) < 2e-3);
    CHECK(way.graph.marginal(way.last).covariance.isApprox(exact, 0.01));
  }
}

TEST_CASE("Undone, freezing all behind leaves the graph as it was", "[freezing]") {
  Way way(11, false);
  const auto before = way.poses();
  const Eigen::Matrix3d exact = way.graph.marginal(way.last).covariance;
  REQUIRE(way.graph.freeze(from_origin(way, 20)));
  way.graph.unfreeze();
  way.settle();
  CHECK(apart(before, way.poses()) < 2e-3);
  CHECK(way.graph.marginal(way.last).covariance.isApprox(exact, 0.01));
  CHECK(way.graph.marginal(*way.graph.origin()).covariance.trace() < 1e-9);
}

TEST_CASE("A node that is tied to too many others is not frozen, and nothing is changed",
          "[freezing]") {
  constexpr state::Format kFormat{"test", 1};
  Way way(1, false);
  const NodeIndex hub = way.nodes[20];
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-3, 1e-3, 1e-5).asDiagonal();
  for (const NodeIndex node : way.nodes) {
    if (node == hub) continue;
    const geometry::SE2 between = way.graph.pose(hub).inverse() * way.graph.pose(node);
    way.add(hub, node, {between * way.noise(covariance), covariance});
  }
  way.settle();
  const std::string before = state::save(kFormat, way.graph);
  CHECK_FALSE(way.graph.freeze(std::array{hub}));
  CHECK(state::save(kFormat, way.graph) == before);
}

TEST_CASE("A node that is tied by next to nothing does not cut the graph where others are frozen",
          "[freezing]") {
  Way way(10, false);
  // A motion of which only one direction is known.
  geometry::SE2WithCovariance weak;
  weak.mean = way.graph.pose(way.nodes[36]).inverse() * way.graph.pose(way.nodes[15]);
  weak.covariance = Eigen::Vector3d(1e-2, 1e12, 1e12).asDiagonal();
  way.add(way.nodes[36], way.nodes[15], weak);
  way.settle();
  const Eigen::Matrix3d covariance = way.graph.marginal(way.last).covariance;
  REQUIRE(way.graph.freeze(std::vector<NodeIndex>(way.nodes.begin() + 8, way.nodes.begin() + 32)));
  for (int i = 0; i < 3; ++i) {
    const auto solved = way.graph.solve();
    INFO(solved.error);
    REQUIRE(solved.ok);
  }
  CHECK(way.graph.marginal(way.last).covariance.isApprox(covariance, 0.05));
}

TEST_CASE("A closure between frozen nodes is known, and taken out again", "[freezing]") {
  Way way(31, false);
  const auto before = way.poses();
  way.graph.add_closure(5, way.nodes[10], way.nodes[30],
                        {way.graph.pose(way.nodes[10]).inverse() * way.graph.pose(way.nodes[30]) *
                             geometry::SE2(0.5, 0.2, 0.0),
                         Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal()});
  way.settle();
  REQUIRE(way.graph.freeze(std::vector<NodeIndex>(way.nodes.begin() + 8, way.nodes.begin() + 32)));
  way.settle();
  REQUIRE(way.graph.has_closure(5));
  way.graph.take_closure_out(5);
  way.settle();
  CHECK_FALSE(way.graph.has_closure(5));
  CHECK(apart(before, way.poses()) < 2e-3);
}

TEST_CASE("A frozen graph is the same after a load", "[freezing]") {
  Way way(5, true);
  const std::vector<NodeIndex> middle(way.nodes.begin() + 8, way.nodes.begin() + 32);
  REQUIRE(way.graph.freeze(middle));
  way.settle();
  constexpr state::Format kFormat{"test", 1};
  PoseGraph loaded{SmoothingMapperParameters{}};
  state::load(state::save(kFormat, way.graph), kFormat, loaded);
  for (int i = 0; i < 6; ++i) REQUIRE(loaded.solve().ok);
  CHECK(loaded.frozen_count() == middle.size());
  for (const NodeIndex node : way.nodes)
    CHECK((loaded.pose(node).translation() - way.graph.pose(node).translation()).norm() < 1e-3);
  CHECK(
      loaded.marginal(way.last).covariance.isApprox(way.graph.marginal(way.last).covariance, 0.01));
}

namespace {

/// Nodes on a way, each tied to the one before and the second before, with a trunk that all see.
struct Stretch {
  PoseGraph graph{SmoothingMapperParameters{}};
  std::vector<NodeIndex> nodes;
  static constexpr model::LandmarkId kTrunk = 7;

  Stretch() {
    const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-3, 4e-4, 1e-6).asDiagonal();
    const geometry::SE2 step(2.0, 0.1, 0.02);
    const Eigen::Vector2d trunk(8.0, 5.0);
    nodes.push_back(graph.add_node({}, false, true));
    graph.add_landmark(kTrunk, trunk, std::nullopt);
    for (int i = 1; i < 9; ++i) {
      nodes.push_back(graph.add_node(graph.pose(nodes.back()) * step, false));
      const double off_m = 0.01 * (i % 3);
      add(nodes[nodes.size() - 2], nodes.back(), {step * geometry::SE2(off_m, 0, 0), covariance});
      const Eigen::Vector2d seen = graph.pose(nodes.back()).inverse() * trunk;
      graph.observe(nodes.back(), kTrunk, seen + Eigen::Vector2d(off_m, 0.0),
                    400.0 * Eigen::Matrix2d::Identity());
    }
    for (int i = 0; i < 4; ++i) REQUIRE(graph.solve().ok);
  }
  void add(NodeIndex from, NodeIndex to, const geometry::SE2WithCovariance& motion) {
    CentreMotion one;
    one.from = from;
    one.from_T_to = motion;
    graph.add_motion(one, to);
  }
  std::vector<NodeIndex> middle() const { return {nodes.begin() + 2, nodes.begin() + 6}; }
  /// The poses of those that stay, once the middle is one node.
  std::vector<geometry::SE2> condensed() {
    const std::vector<Retirement> retired = graph.condense(middle());
    REQUIRE(retired.size() == 4);
    for (int i = 0; i < 4; ++i) REQUIRE(graph.solve().ok);
    return {graph.pose(nodes[1]), graph.pose(retired.front().into), graph.pose(nodes.back())};
  }
};

}  // namespace

TEST_CASE("A stretch that was condensed ahead is as if it was not", "[freezing]") {
  Stretch at_once;
  Stretch ahead;
  ahead.graph.condense_ahead(ahead.middle());
  CHECK(apart(at_once.condensed(), ahead.condensed()) == 0.0);
}

TEST_CASE("What is measured after a stretch was condensed ahead counts", "[freezing]") {
  const Eigen::Matrix3d covariance = 1e-4 * Eigen::Matrix3d::Identity();
  const auto with = [&](bool is_ahead, auto&& measure) {
    Stretch one;
    if (is_ahead) one.graph.condense_ahead(one.middle());
    measure(one);
    return one.condensed();
  };

  const auto nothing = [](Stretch&) {};
  const auto motion = [&](Stretch& one) {
    one.add(one.nodes[3], one.nodes[5], {geometry::SE2(4.1, 0.3, 0.04), covariance});
  };
  const auto again = [&](Stretch& one) {
    one.graph.observe(one.nodes[4], Stretch::kTrunk, {0.3, 4.0},
                      900.0 * Eigen::Matrix2d::Identity());
  };
  const auto moved = [&](Stretch& one) {
    one.add(one.nodes[1], one.nodes[7], {geometry::SE2(12.5, 1.2, 0.12), covariance});
    for (int i = 0; i < 4; ++i) REQUIRE(one.graph.solve().ok);
  };

  const auto plain = with(false, nothing);
  const auto check = [&](auto&& measure) {
    const auto expected = with(false, measure);
    CHECK(apart(expected, plain) > 1e-3);
    CHECK(apart(expected, with(true, measure)) == 0.0);
  };

  check(motion);
  check(again);
  check(moved);
}
