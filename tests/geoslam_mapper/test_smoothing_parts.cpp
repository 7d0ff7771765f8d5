// The parts of the mapper: graph with rollback, landmarks with index, viewpoints.
#include <Eigen/LU>
#include <map>
#include <random>

#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/place_recogniser.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

const Eigen::Matrix2d kInformation = 1e4 * Eigen::Matrix2d::Identity();

std::string saved(const PoseGraph& graph) { return state::save({"graph"}, graph); }

/// Two nodes that observe three landmarks.
PoseGraph small_graph() {
  SmoothingMapperParameters parameters;
  parameters.gyro_walk = 1e-5;
  PoseGraph graph(parameters);
  graph.add_node({}, false, true);
  graph.add_node({2.0, 0.0, 0.1}, false);
  for (model::LandmarkId id = 1; id <= 3; ++id) {
    const Eigen::Vector2d position(3.0 * static_cast<double>(id), id % 2 == 0 ? 4.0 : -4.0);
    graph.add_landmark(id, position, std::nullopt);
    for (const NodeIndex node : {0U, 1U})
      graph.observe(node, id, graph.pose(node).inverse() * position, kInformation);
  }
  REQUIRE(graph.solve().ok);
  return graph;
}

CentreMotion turn_from(NodeIndex node) {
  CentreMotion motion;
  motion.from = node;
  motion.utime = 1'000'000;
  motion.from_T_to = {{1.0, 0.0, 0.2}, 1e-4 * Eigen::Matrix3d::Identity()};
  motion.gyro = model::GyroRotation{0.2, 1e-6, 1.0, 0.0};
  motion.odometry_bias = 1e-3;
  return motion;
}

model::Keyframe keyframe_at(model::Utime utime, double driven_m) {
  model::Keyframe keyframe;
  keyframe.utime = utime;
  const Eigen::Matrix3d exact = Eigen::Matrix3d::Zero();
  keyframe.members.push_back({utime, 0, {-0.5 * driven_m, 0.0, 0.0}, exact});
  keyframe.members.push_back({utime + 1, 1, {0.5 * driven_m, 0.0, 0.0}, exact});
  return keyframe;
}

}  // namespace

TEST_CASE("A rollback takes back nodes, landmarks, observations and the gyro's bias", "[mapper]") {
  PoseGraph graph = small_graph();
  const std::string before = saved(graph);

  // A new node with a new landmark.
  graph.checkpoint();
  const NodeIndex node = graph.add_node({3.0, 0.2, 0.3}, false);
  graph.add_landmark(9, {7.0, 7.0}, Eigen::Matrix2d(0.01 * Eigen::Matrix2d::Identity()));
  graph.observe(node, 9, {4.0, 6.0}, kInformation);
  graph.observe(node, 1, {0.5, -4.5}, kInformation);
  graph.add_motion(turn_from(1), node);
  REQUIRE(graph.solve().ok);
  REQUIRE(saved(graph) != before);
  graph.rollback();
  CHECK(saved(graph) == before);
  CHECK_FALSE(graph.position(9));

  // An old node that observes again, an observation less.
  graph.checkpoint();
  graph.observe(1, 1, {1.5, -4.5}, kInformation);
  graph.ignore(1, 2);
  graph.add_motion(turn_from(1), 1);
  REQUIRE(graph.solve().ok);
  REQUIRE(saved(graph) != before);
  graph.rollback();
  CHECK(saved(graph) == before);
  CHECK(graph.node(1).observations().size() == 3);
}

TEST_CASE("Observations that are handed over hold the landmark that stays", "[mapper]") {
  PoseGraph graph = small_graph();
  const NodeIndex node = graph.add_node({4.0, 0.0, 0.1}, false);
  graph.add_landmark(4, {6.1, 4.1}, std::nullopt);
  graph.observe(node, 4, graph.pose(node).inverse() * Eigen::Vector2d(6.0, 4.0), kInformation);
  graph.observe(node, 1, graph.pose(node).inverse() * Eigen::Vector2d(3.0, -4.0), kInformation);
  graph.observe(node, 3, graph.pose(node).inverse() * Eigen::Vector2d(9.0, -4.0), kInformation);
  REQUIRE(graph.solve().ok);
  const std::vector<NodeIndex> nodes{node};
  graph.hand_over(4, 2, nodes);
  REQUIRE(graph.solve().ok);
  CHECK_FALSE(graph.position(4));
  CHECK(graph.node(node).observations().contains(2));
  CHECK((*graph.position(2) - Eigen::Vector2d(6.0, 4.0)).norm() < 1e-3);
  CHECK((graph.pose(node).translation() - Eigen::Vector2d(4.0, 0.0)).norm() < 1e-3);
}

TEST_CASE("The index of landmarks follows in steps, and changes are reported once", "[mapper]") {
  LandmarkMap landmarks;
  StoredLandmark landmark;
  landmark.position_m = {1.0, 2.0};
  landmark.information = 1.0;
  const model::LandmarkId id = landmarks.insert(landmark);
  const model::LandmarkId gone = landmarks.insert(landmark);
  landmarks.remove(gone);
  CHECK(landmarks.take_changed() == std::vector<model::LandmarkId>{id});
  CHECK(landmarks.take_changed().empty());

  // A small move waits for catch_up(), a large one does not.
  landmarks.move(id, {1.1, 2.0});
  CHECK(landmarks.index().position(id)->x() == 1.0);
  landmarks.catch_up();
  CHECK(landmarks.index().position(id)->x() == 1.1);
  // Then it is off by a centimetre at most.
  landmarks.move(id, {1.109, 2.0});
  landmarks.catch_up();
  CHECK(landmarks.index().position(id)->x() == 1.1);
  landmarks.move(id, {1.111, 2.0});
  landmarks.catch_up();
  CHECK(landmarks.index().position(id)->x() == 1.111);
  landmarks.move(id, {2.0, 2.0});
  CHECK(landmarks.index().position(id)->x() == 2.0);
  CHECK(landmarks.take_changed() == std::vector<model::LandmarkId>{id});

  // What waits is in the saved state.
  landmarks.move(id, {2.1, 2.0});
  const std::string state = state::save({"landmarks"}, landmarks);
  LandmarkMap loaded;
  state::load(state, {"landmarks"}, loaded);
  CHECK(loaded.at(id).position_m.x() == 2.1);
  CHECK(loaded.index().position(id)->x() == 2.0);
  CHECK(state::save({"landmarks"}, loaded) == state);
  loaded.catch_up();
  CHECK(loaded.index().position(id)->x() == 2.1);
}

TEST_CASE("The index has the triangles of where landmarks are when it has caught up", "[mapper]") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  LandmarkMap landmarks;
  std::vector<model::LandmarkId> ids;
  for (int i = 0; i < 200; ++i) {
    StoredLandmark one;
    one.position_m = {30.0 * normal(random), 30.0 * normal(random)};
    ids.push_back(landmarks.insert(one));
  }

  // Large moves and small ones, of landmarks that are in use and that are not.
  for (int round = 0; round < 5; ++round) {
    for (const model::LandmarkId id : ids) {
      const double step_m = random() % 2 == 0 ? 1.0 : 0.05;
      const Eigen::Vector2d off_m(step_m * normal(random), step_m * normal(random));
      landmarks.move(id, landmarks.at(id).position_m + off_m);
      if (random() % 10 == 0) landmarks.set_in_use(id, random() % 2 == 0);
    }
    landmarks.catch_up();
    REQUIRE(landmarks.index().is_settled());
    REQUIRE(landmarks.unused_index().is_settled());
    LandmarkMap loaded;  // Its index is made from scratch.
    state::load(state::save({"landmarks"}, landmarks), {"landmarks"}, loaded);
    REQUIRE(landmarks.index().triangles() == loaded.index().triangles());
    REQUIRE(landmarks.unused_index().triangles() == loaded.unused_index().triangles());
  }
}

TEST_CASE("A map whose landmarks are given away keeps nothing of them", "[mapper]") {
  LandmarkMap map;
  const auto bytes = [&map] { return state::save({"landmarks"}, map).size(); };
  const std::size_t empty = bytes();
  for (int i = 0; i < 1000; ++i) {
    StoredLandmark landmark;
    landmark.position_m = {5.0 * i, 0.0};
    const model::LandmarkId id = map.insert(landmark);
    map.move(id, {5.0 * i + 0.02, 0.0});  // Not at once in the index.
    (void)map.put_away(id);
    (void)map.take_changed();
  }
  CHECK(bytes() < empty + 100);

  // One that comes and goes counts once.
  const model::LandmarkId id = map.insert({});
  for (int i = 1; i <= 1000; ++i) {
    map.move(id, {0.02, 0.0});
    map.bring_back(map.put_away(id));
    map.move(id, {0.0, 0.0});
  }
  map.move(id, {0.05, 0.0});
  CHECK(bytes() < empty + 500);
  map.catch_up();
  CHECK(*map.index().position(id) == Eigen::Vector2d(0.05, 0.0));
}

TEST_CASE("Only a keyframe from a viewpoint that is known is folded", "[mapper]") {
  SmoothingMapperParameters parameters;
  GlobalMap map(parameters);
  const model::Keyframe first = keyframe_at(10, 0.0);
  CHECK(map.trajectory.is_stationary(first));
  CHECK_FALSE(map.trajectory.is_stationary(keyframe_at(10, 2.0 * parameters.fold_distance_m)));
  const NodeIndex node = map.graph.add_node({1.0, 1.0, 0.5}, true);
  map.trajectory.add(base_of(first, node), map.graph);

  const auto revisited = [&](double x, double theta) {
    return map.trajectory.revisited({1.0 + x, 1.0, 0.5 + theta}, map.graph);
  };
  CHECK(revisited(0.0, 0.0) == node);
  CHECK(revisited(0.9 * parameters.fold_distance_m, 0.0) == node);
  CHECK_FALSE(revisited(1.1 * parameters.fold_distance_m, 0.0));
  CHECK(revisited(0.0, -0.9 * parameters.fold_angle_rad) == node);
  CHECK_FALSE(revisited(0.0, 1.1 * parameters.fold_angle_rad));
}

TEST_CASE("The grid of viewpoints has every point near a place, wherever that is", "[mapper]") {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  ViewpointGrid grid;
  std::map<std::uint32_t, Eigen::Vector2d> points;
  for (int step = 0; step < 3000; ++step) {
    const auto number = static_cast<std::uint32_t>(random() % 60);
    if (random() % 3 == 0) {
      grid.remove(number);
      points.erase(number);
    } else {
      points[number] = {place(random), place(random)};
      grid.put(number, points[number]);
    }

    const Eigen::Vector2d centre(place(random), place(random));
    std::map<std::uint32_t, int> found;
    grid.for_each_near(centre, 1.5, [&](std::uint32_t one) { ++found[one]; });
    for (const auto& [one, times] : found) REQUIRE((times == 1 && points.contains(one)));
    for (const auto& [one, position] : points) {
      if ((position - centre).norm() < 1.5) REQUIRE(found.contains(one));
    }
  }
}
