// Landmarks that are out of the solved graph.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/one_map.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kNodeStep_m = 10.0;
constexpr int kNodes = 12;

/// Condensed nodes on a line that saw trunks around with noise, and little odometry.
struct World {
  GlobalMap map{SmoothingMapperParameters{}};
  std::vector<NodeIndex> nodes;
  std::vector<model::LandmarkId> ids;
};

World world(std::uint64_t seed, double anisotropy) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> along(-20.0, kNodes * kNodeStep_m + 10.0);
  std::uniform_real_distribution<double> across(-25.0, 25.0);
  World result;

  GlobalMap& map = result.map;
  std::vector<geometry::SE2> truth;
  for (int i = 0; i < kNodes; ++i) {
    truth.emplace_back(kNodeStep_m * i, 0.3 * i, 0.02 * i);
    const geometry::SE2 guess = truth.back() * geometry::SE2(0.02 * normal(random), 0.0, 0.0);
    result.nodes.push_back(map.graph.add_node(i == 0 ? truth.back() : guess, false, i == 0));
  }

  for (int i = 0; i < 70; ++i) {
    const Eigen::Vector2d position(along(random), across(random));
    StoredLandmark landmark;
    landmark.position_m = position;
    landmark.information = 1e4;

    std::vector<std::pair<NodeIndex, Eigen::Vector2d>> seen;
    for (int k = 0; k < kNodes; ++k) {
      const Eigen::Vector2d local = truth[k].inverse() * position;
      if (local.norm() < 35.0) seen.emplace_back(result.nodes[k], local);
    }
    if (seen.empty()) continue;
    for (const auto& [node, local] : seen) landmark.observed_from(node);
    const model::LandmarkId id = map.landmarks.insert(landmark);
    result.ids.push_back(id);
    map.graph.add_landmark(id, position, std::nullopt);
    for (const auto& [node, local] : seen) {
      // Well known across the line of sight, worse along it.
      const Eigen::Vector2d ray = local.normalized();
      const Eigen::Matrix2d covariance =
          4e-4 * (Eigen::Matrix2d::Identity() + anisotropy * ray * ray.transpose());
      const Eigen::Vector2d noise = 0.02 * Eigen::Vector2d(normal(random), normal(random)) +
                                    0.02 * std::sqrt(anisotropy) * normal(random) * ray;
      map.graph.observe(node, id, local + noise, covariance.inverse());
    }
  }
  REQUIRE(map.graph.solve().ok);
  REQUIRE(map.graph.solve().ok);
  return result;
}

std::vector<geometry::SE2> poses(const World& world) {
  std::vector<geometry::SE2> result;
  for (const NodeIndex node : world.nodes) result.push_back(world.map.graph.pose(node));
  return result;
}

/// Largest distance of two sets of poses.
double apart_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, (a[i].translation() - b[i].translation()).norm());
  return largest;
}

}  // namespace

TEST_CASE("Dormant landmarks leave the nodes where they were, and as sure", "[mapper]") {
  for (const double anisotropy : {0.0, 3.0}) {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
      World one = world(seed, anisotropy);
      PoseGraph& graph = one.map.graph;
      const auto before = poses(one);
      const NodeIndex last = one.nodes.back();
      const Eigen::Matrix3d covariance = graph.marginal(last).covariance;

      // Half of them, then all.
      const std::span<const model::LandmarkId> ids = one.ids;
      graph.make_dormant(ids.first(ids.size() / 2), one.map.landmarks.all());
      REQUIRE(graph.solve().ok);
      graph.make_dormant(ids.subspan(ids.size() / 2), one.map.landmarks.all());
      for (int i = 0; i < 3; ++i) REQUIRE(graph.solve().ok);
      CHECK(graph.awake().empty());
      const double sigma_m = std::sqrt(covariance.topLeftCorner<2, 2>().trace());
      CHECK(apart_m(before, poses(one)) < (anisotropy == 0.0 ? 0.01 : 0.3) * sigma_m);
      const Eigen::Matrix3d dormant = graph.marginal(last).covariance;
      const double limit = anisotropy == 0.0 ? 0.01 : 0.15;
      for (int k = 0; k < 3; ++k)
        CHECK(dormant(k, k) / covariance(k, k) == Approx(1.0).margin(limit));

      // All of them back.
      graph.wake(ids);
      for (int i = 0; i < 3; ++i) REQUIRE(graph.solve().ok);
      CHECK(apart_m(before, poses(one)) < 0.01 * sigma_m);
      CHECK(graph.marginal(last).covariance.isApprox(covariance, 0.01));
      CHECK(graph.awake().size() == ids.size());
    }
  }
}

TEST_CASE("Where rays tell little, dormant landmarks tell less, not more", "[mapper]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    World one = world(seed, 100.0);
    PoseGraph& graph = one.map.graph;
    const auto before = poses(one);
    const Eigen::Matrix3d covariance = graph.marginal(one.nodes.back()).covariance;
    graph.make_dormant(one.ids, one.map.landmarks.all());
    for (int i = 0; i < 3; ++i) REQUIRE(graph.solve().ok);
    const Eigen::Matrix3d dormant = graph.marginal(one.nodes.back()).covariance;
    CHECK(apart_m(before, poses(one)) < 1.5 * std::sqrt(dormant.topLeftCorner<2, 2>().trace()));
    CHECK(dormant.trace() > 0.8 * covariance.trace());
    CHECK(dormant.trace() < 4.0 * covariance.trace());
  }
}

TEST_CASE("Dormant landmarks follow their nodes", "[mapper]") {
  World one = world(7, 0.0);
  GlobalMap& map = one.map;
  map.graph.make_dormant(one.ids, map.landmarks.all());
  REQUIRE(map.graph.solve().ok);
  const auto place = [&](model::LandmarkId id) { return map.graph.dormant_position(id); };
  const Eigen::Vector2d before = place(one.ids.back());

  // The last node is pulled aside by something else.
  map.graph.checkpoint();
  const NodeIndex last = one.nodes.back();
  const model::LandmarkId mark = map.landmarks.insert({});
  const Eigen::Vector2d there = map.graph.pose(last) * Eigen::Vector2d(1.0, 0.0);
  map.graph.add_landmark(mark, there + Eigen::Vector2d(0.0, 2.0),
                         1e-8 * Eigen::Matrix2d::Identity());
  map.graph.observe(last, mark, {1.0, 0.0}, 1e6 * Eigen::Matrix2d::Identity());
  for (int i = 0; i < 5; ++i) REQUIRE(map.graph.solve().ok);
  const std::vector<model::LandmarkId> moved = map.adopt_estimates();

  CHECK((place(one.ids.back()) - before).norm() > 0.03);
  for (const model::LandmarkId id : one.ids) {
    const double stale_m = (map.landmarks.at(id).position_m - place(id)).norm();
    CHECK(stale_m < 2.0 * PoseGraph::kDormantMove_m);
  }
  CHECK(std::find(moved.begin(), moved.end(), one.ids.back()) != moved.end());
}

namespace {

/// Some of the landmarks, each with nodes that others have in common with it.
std::vector<model::LandmarkId> every_third(const World& world, std::size_t first) {
  std::vector<model::LandmarkId> ids;
  for (std::size_t i = first; i < world.ids.size(); i += 3) ids.push_back(world.ids[i]);
  return ids;
}

/// All of it dormant, and solved.
World asleep(std::uint64_t seed) {
  World result = world(seed, 1.0);
  for (const NodeIndex node : result.nodes) result.map.graph.close(node);
  result.map.graph.make_dormant(result.ids, result.map.landmarks.all());
  for (int i = 0; i < 5; ++i) REQUIRE(result.map.graph.solve().ok);
  return result;
}

}  // namespace

TEST_CASE("Landmarks that go elsewhere and come back leave the graph as it is", "[mapper]") {
  for (const std::uint64_t seed : {1, 2, 3}) {
    World one = asleep(seed);
    PoseGraph& graph = one.map.graph;
    const Eigen::Matrix3d covariance = graph.marginal(one.nodes.back()).covariance;

    std::vector<AwayLandmarks> away;
    const auto is_unmoved = [&] {
      graph.checkpoint();
      REQUIRE(graph.solve().ok);
      return graph.moved_nodes().empty() &&
             graph.marginal(one.nodes.back()).covariance == covariance;
    };

    for (std::size_t part = 0; part < 3; ++part) {
      away.push_back(graph.put_away(every_third(one, part)));
      CHECK(is_unmoved());
    }
    for (const std::size_t part : {1, 0, 2}) {
      graph.bring_back(every_third(one, part), away[part]);
      CHECK(is_unmoved());
    }
  }
}

TEST_CASE("What wakes beside landmarks that are elsewhere is counted once", "[mapper]") {
  for (const std::uint64_t seed : {1, 2, 3}) {
    World one = asleep(seed);
    PoseGraph& graph = one.map.graph;
    const auto before = poses(one);
    const Eigen::Matrix3d covariance = graph.marginal(one.nodes.back()).covariance;
    const double sigma_m = std::sqrt(covariance.topLeftCorner<2, 2>().trace());
    const auto is_same = [&] {
      for (int i = 0; i < 3; ++i) REQUIRE(graph.solve().ok);
      CHECK(apart_m(before, poses(one)) < 0.1 * sigma_m);
      CHECK(graph.marginal(one.nodes.back()).covariance.isApprox(covariance, 0.1));
    };

    // One part is elsewhere, one wakes; then the first comes back and wakes, too.
    const AwayLandmarks away = graph.put_away(every_third(one, 0));
    graph.wake(every_third(one, 1));
    is_same();
    graph.bring_back(every_third(one, 0), away);
    graph.wake(every_third(one, 0));
    is_same();
    graph.make_dormant(every_third(one, 1), one.map.landmarks.all());
    graph.put_away(every_third(one, 1));
    is_same();
  }
}

namespace {

/// A drive of 400 m straight through a forest, and back beside its first half.
OneMap driven(const sim::Drive& drive, double condense_m) {
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapperParameters parameters;
  parameters.condense_m = condense_m;
  OneMap map(parameters);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (const auto keyframe = keyframer.add(drive.scan(k).scan)) map.add(*keyframe);
  }
  return map;
}

}  // namespace

TEST_CASE("The solved graph is that of the ground around the vehicle", "[mapper]") {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kLine;
  parameters.path.length_m = 400.0;
  parameters.sensor.position_sigma_m = 0.1;
  parameters.clear_the_path = true;
  const sim::Drive drive(parameters, 5);
  const OneMap bounded = driven(drive, 10.0);
  const OneMap whole = driven(drive, 0.0);

  // What is solved, and what is known.
  CHECK(bounded.map().graph.node_count() < whole.map().graph.node_count() / 3);
  CHECK(bounded.map().graph.awake().size() < whole.map().graph.awake().size() * 6 / 10);
  CHECK(bounded.map().landmarks.all().size() == whole.map().landmarks.all().size());

  // The two trajectories, and how sure each is of its end.
  const auto of_bounded = bounded.told_poses();
  const auto of_whole = whole.told_poses();
  REQUIRE(of_bounded.size() == of_whole.size());
  double squared = 0.0;
  for (std::size_t i = 0; i < of_whole.size(); ++i) {
    squared += (of_bounded[i].map_T_vehicle.translation() - of_whole[i].map_T_vehicle.translation())
                   .squaredNorm();
  }
  CHECK(std::sqrt(squared / static_cast<double>(of_whole.size())) < 0.01);
  const double ratio = of_bounded.back().covariance.trace() / of_whole.back().covariance.trace();
  CHECK(ratio > 0.7);
  CHECK(ratio < 1.2);

  // Its landmarks' covariances.
  const auto landmarks = bounded.told_landmarks();
  for (const model::MapLandmark& landmark : landmarks)
    CHECK(landmark.covariance_m2.determinant() > 0.0);
}

TEST_CASE("A map with dormant landmarks goes on after it was saved", "[mapper]") {
  World one = world(9, 1.0);
  PoseGraph& graph = one.map.graph;
  graph.make_dormant(std::span(one.ids).first(40), one.map.landmarks.all());
  REQUIRE(graph.solve().ok);
  constexpr state::Format kFormat{"test.map", 1};
  World other;
  state::load(state::save(kFormat, one.map), kFormat, other.map);
  other.nodes = one.nodes;
  other.ids = one.ids;
  CHECK(apart_m(poses(one), poses(other)) < 1e-6);
  CHECK(other.map.graph.is_dormant(one.ids[0]));
  for (World* both : {&one, &other}) {
    both->map.wake(both->ids);
    REQUIRE(both->map.graph.solve().ok);
  }
  CHECK(apart_m(poses(one), poses(other)) < 1e-3);
}
