// A closure in a stored map is what it is in the graph that the map came from.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "tests/catch.hpp"
#include "tests/map_closure/ring_map.hpp"

using namespace understory;
using namespace understory::map_closure;
using Catch::Matchers::Contains;
using test::farthest_m;
using test::RingMap;

namespace {

Closure between(const PartGraph& graph, const map_file::StoredMap& map, std::uint64_t from,
                std::uint64_t to, const geometry::SE2WithCovariance& pose) {
  return closure_between(placed_end(map, graph, {from, 0}, ""), placed_end(map, graph, {to, 0}, ""),
                         pose);
}

std::vector<geometry::SE2> truth_of(const RingMap& ring) {
  std::vector<geometry::SE2> truth;
  for (std::size_t i = 0; i < ring.size(); ++i) truth.push_back(ring.truth(i));
  return truth;
}

}  // namespace

TEST_CASE("A closure moves stored submaps to where the batch solution has them", "[map_closure]") {
  double before_m = 0.0;
  double after_m = 0.0;
  double batch_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    RingMap ring({.seed = seed});
    const PartGraph graph = ring.graph();
    CHECK(graph.motions == ring.size() - 1);
    CHECK(graph.assumed == 0);
    const std::size_t last = ring.size() - 1;
    const auto pose = ring.measured(3, last);
    const Closure closure = between(graph, ring.map, 4, last + 1, pose);
    CHECK(expectation(graph, closure).chi2 < kContradiction);

    const ClosedGraph made = closed(graph, closure);
    const auto batch = ring.batch(3, last, pose);
    CHECK(farthest_m(made.poses, batch) < 0.02);
    CHECK(made.closure_chi2 < 16.0);
    before_m += farthest_m(graph.graph.poses, truth_of(ring));
    after_m += farthest_m(made.poses, truth_of(ring));
    batch_m += farthest_m(batch, truth_of(ring));
  }
  WARN(fmt::format(
      "farthest from the truth, mean of 10: {:.3f} m before, {:.3f} after, batch {:.3f}",
      before_m / 10.0, after_m / 10.0, batch_m / 10.0));
  CHECK(after_m < 0.5 * before_m);
  CHECK(after_m < 1.05 * batch_m);
}

TEST_CASE("Landmarks, trajectory and borders move with their submaps", "[map_closure]") {
  RingMap ring({.seed = 3});
  ring.map.submap_borders = {{5, {{1.0, 2.0}, {3.0, 4.0}, {5.0, 9.0}}}};
  ring.map.loop_closures = {{0, 30, ring.map.keyframes[0].map_T_vehicle.translation(),
                             ring.map.keyframes[30].map_T_vehicle.translation()}};
  const PartGraph graph = ring.graph();
  const std::size_t last = ring.size() - 1;
  const ClosedGraph made =
      closed(graph, between(graph, ring.map, 1, last + 1, ring.measured(0, last)));
  Shifts shifts;
  const map_file::StoredMap after = moved(ring.map, graph, made, shifts);
  REQUIRE(map_file::fault_of(after).empty());
  CHECK(shifts.parts > ring.size() / 2);
  CHECK(shifts.landmark_m > 0.05);

  double farthest = 0.0;
  for (std::size_t i = 0; i < after.landmarks.size(); ++i) {
    const auto& was = ring.map.landmarks[i];
    const auto& is = after.landmarks[i];
    const std::size_t place = *was.submap_id - 1;
    const Eigen::Vector2d expected =
        made.poses[place] * (ring.estimate(place).inverse() * was.landmark.position_m);
    CHECK((is.landmark.position_m - expected).norm() < 1e-9);
    farthest = std::max(farthest, (is.landmark.position_m - was.landmark.position_m).norm());
    // Relative to its submap it is known as before.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> a(was.landmark.covariance_m2);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> b(is.landmark.covariance_m2);
    CHECK((a.eigenvalues() - b.eigenvalues()).norm() < 1e-12);
  }
  CHECK(shifts.landmark_m >= farthest);
  for (std::size_t k = 0; k < after.keyframes.size(); ++k) {
    const std::size_t place = k / 3;
    const geometry::SE2 expected =
        made.poses[place] * ring.submaps[place].keyframes[k % 3].map_T_vehicle;
    CHECK((expected.inverse() * after.keyframes[k].map_T_vehicle).Log().norm() < 1e-9);
    CHECK(after.keyframes[k].covariance == ring.map.keyframes[k].covariance);
  }
  const geometry::SE2 turn = made.poses[4] * ring.estimate(4).inverse();
  CHECK((after.submap_borders[0].corners_m[2] - turn * Eigen::Vector2d(5.0, 9.0)).norm() < 1e-9);
  CHECK((after.loop_closures[0].to_m - after.keyframes[30].map_T_vehicle.translation()).norm() <
        1e-9);
  // The first submap carries the frame.
  CHECK((made.poses[0].inverse() * ring.estimate(0)).Log().norm() < 1e-4);
}

TEST_CASE("A closure that says what the map says moves nothing", "[map_closure]") {
  RingMap ring({.seed = 4, .ground = 3});
  const PartGraph graph = ring.graph();
  const std::size_t last = ring.stored() - 1;
  geometry::SE2WithCovariance pose = ring.measured(0, last);
  pose.mean = ring.estimate(0).inverse() * ring.estimate(last);
  const Closure closure = between(graph, ring.map, 1, last + 1, pose);
  CHECK(expectation(graph, closure).chi2 < 1e-9);
  const ClosedGraph made = closed(graph, closure);
  CHECK(farthest_m(made.poses, graph.graph.poses) < 1e-6);
  CHECK(made.closure_chi2 + made.graph_chi2 < 1e-9);
}

TEST_CASE("Which end is named first makes no difference, nor whether by keyframe or submap",
          "[map_closure]") {
  RingMap ring({.seed = 5});
  const PartGraph graph = ring.graph();
  const std::size_t last = ring.size() - 1;
  const auto pose = ring.measured(2, last);
  const auto there = closed(graph, between(graph, ring.map, 3, last + 1, pose));
  const auto back = closed(graph, between(graph, ring.map, last + 1, 3, geometry::inverse(pose)));
  CHECK(farthest_m(there.poses, back.poses) < 1e-3);

  // The third keyframe of each, 5 m ahead.
  const PlacedEnd from = placed_end(ring.map, graph, {0, 3 * 2 + 2}, "");
  const PlacedEnd to = placed_end(ring.map, graph, {0, 3 * last + 2}, "");
  CHECK(from.part == 2);
  const geometry::SE2WithCovariance ahead{from.part_T_end.inverse(), Eigen::Matrix3d::Zero()};
  const geometry::SE2WithCovariance end{to.part_T_end, Eigen::Matrix3d::Zero()};
  const Closure closure = closure_between(from, to, compound(compound(ahead, pose), end));
  CHECK((closure.from_T_to.mean.inverse() * pose.mean).Log().norm() < 1e-9);
  CHECK((closure.from_T_to.covariance - pose.covariance).norm() < 1e-9);
}

TEST_CASE("Ground beside the submaps follows, and its covariances lose what the closure tells",
          "[map_closure]") {
  RingMap ring({.seed = 6, .ground = 4});
  const PartGraph graph = ring.graph();
  CHECK(graph.parts.size() > ring.stored());
  CHECK(graph.assumed == graph.parts.size() - ring.stored() - 1);
  const std::size_t last = ring.stored() - 1;
  const ClosedGraph made =
      closed(graph, between(graph, ring.map, 1, last + 1, ring.measured(0, last)));
  Shifts shifts;
  const map_file::StoredMap after = moved(ring.map, graph, made, shifts);
  REQUIRE(map_file::fault_of(after).empty());

  // Where it is nearly rigid to the last submap.
  const std::size_t k = 3 * ring.stored() + 1;
  const auto place = [&](const map_file::StoredMap& map) {
    return map.keyframes[k - 3].map_T_vehicle.inverse() * map.keyframes[k].map_T_vehicle;
  };
  CHECK((place(ring.map).inverse() * place(after)).Log().head<2>().norm() < 0.02);
  CHECK(after.keyframes[k].covariance.trace() < ring.map.keyframes[k].covariance.trace());
  std::size_t sharper = 0;
  std::size_t of_ground = 0;
  for (std::size_t i = 0; i < after.landmarks.size(); ++i) {
    if (after.landmarks[i].submap_id) continue;
    ++of_ground;
    const double is = after.landmarks[i].landmark.covariance_m2.trace();
    const double was = ring.map.landmarks[i].landmark.covariance_m2.trace();
    CHECK(is < 1.0001 * was);
    if (is < was) ++sharper;
  }
  CHECK(of_ground > 10);
  CHECK(sharper > of_ground / 2);
}

TEST_CASE("A closure against what is known is seen to be one", "[map_closure]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RingMap ring({.seed = seed});
    const PartGraph graph = ring.graph();
    const std::size_t last = ring.size() - 1;
    auto pose = ring.measured(0, last);
    pose.mean = geometry::SE2(0.0, 30.0, 0.0) * pose.mean;
    CHECK(expectation(graph, between(graph, ring.map, 1, last + 1, pose)).chi2 > kContradiction);
  }
}

TEST_CASE("Closures that are in the file hold", "[map_closure]") {
  RingMap ring({.seed = 8});
  model::LoopClosure known;
  known.id = 7;
  known.from.submap = 1;
  known.to.submap = ring.size();
  const std::size_t last = ring.size() - 1;
  const auto far = [&](const PartGraph& graph) {
    return expectation(graph, between(graph, ring.map, 1, last + 1, ring.measured(0, last)))
        .from_T_to.covariance.trace();
  };
  const double open = far(ring.graph());
  CHECK(far(part_graph(ring.map, ring.submaps, ring.ties, {{known}})) < 0.3 * open);
  // Its own measurement, where the mapper left it, counts instead, once.
  Ties measured = ring.ties;
  for (int i = 0; i < 2; ++i)
    measured.motions.push_back({0, static_cast<NodeNumber>(last),
                                ring.estimate(0).inverse() * ring.estimate(last),
                                1e-9 * Eigen::Matrix3d::Identity(), 7});
  CHECK(far(part_graph(ring.map, ring.submaps, measured, {{known}})) > 0.9 * open);
  // One whose ends are gone says nothing.
  known.to.submap = 999;
  CHECK(far(part_graph(ring.map, ring.submaps, ring.ties, {{known}})) > 0.9 * open);
}

TEST_CASE("What cannot be closed is refused in words", "[map_closure]") {
  RingMap ring({.seed = 9});
  const PartGraph graph = ring.graph();
  CHECK_THROWS_WITH(placed_end(ring.map, graph, {777, 0}, "--to submap:777"),
                    "--to submap:777: map 1 has no submap 777");
  CHECK_THROWS_WITH(placed_end(ring.map, graph, {0, 5000}, ""), "map 1 has no keyframe 5000");
  auto pose = ring.measured(0, 20);
  CHECK_THROWS_WITH(between(graph, ring.map, 3, 3, pose), Contains("both ends are in one part"));
  pose.covariance.setZero();
  CHECK_THROWS_WITH(between(graph, ring.map, 3, 9, pose), Contains("no numbers > 0"));
  pose = ring.measured(0, 20);
  pose.mean = {std::nan(""), 0.0, 0.0};
  CHECK_THROWS_WITH(between(graph, ring.map, 3, 9, pose), Contains("no numbers > 0"));
  CHECK_THROWS_WITH(part_graph(ring.map, {}, ring.ties, {}), Contains("has no submaps"));
  CHECK_THROWS_WITH(part_graph(ring.map, ring.submaps, {}, {}), Contains("nothing is known"));
}
