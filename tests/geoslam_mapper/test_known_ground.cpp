// What is seen again adds information, not states.
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "services/geoslam_mapper/smoothing/known_ground.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kLap_m = 80.0;
constexpr double kScan_m = 0.53;  // no lap's keyframes are where the last lap's were

geometry::SE2 on_circle(double along_m) {
  const double radius_m = kLap_m / (2.0 * std::numbers::pi);
  const double angle = along_m / radius_m;
  return {radius_m * std::sin(angle), radius_m * (1.0 - std::cos(angle)), angle};
}

/// What laps round a circle in a forest give.
struct Laps {
  std::vector<std::size_t> state_bytes;  ///< After each lap.
  double squared_m2 = 0.0;               ///< Of the second half.
  double nees = 0.0;
  int poses = 0;
  std::size_t landmarks = 0;

  double rms_m() const { return std::sqrt(squared_m2 / poses); }
  double mean_nees() const { return nees / poses; }
};

void count(const model::MapUpdate& update, const geometry::SE2& map_T_vehicle, Laps& laps) {
  const Eigen::Vector3d error = (update.map_T_vehicle.inverse() * map_T_vehicle).Log();
  laps.squared_m2 += error.head<2>().squaredNorm();
  laps.nees += error.dot(update.covariance.inverse() * error);
  ++laps.poses;
}

Laps drive_laps(double known_ground_m, int count_of_laps, std::uint64_t seed) {
  sim::DriveParameters drive;
  drive.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  drive.forest.side_m = 200.0;
  drive.path.length_m = kLap_m;
  drive.sensor.position_sigma_m = 0.1;
  const sim::Drive simulated(drive, seed);
  const geometry::SE2 world_T_start = simulated.world_T_vehicle().front();

  std::mt19937_64 random(seed);
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapperParameters parameters;
  parameters.known_ground_m = known_ground_m;
  if (known_ground_m == 0.0) parameters.condense_m = 0.0;
  SmoothingMapper mapper(parameters);
  Laps laps;
  std::vector<geometry::SE2> truth;
  for (double along_m = 0.0; along_m < kLap_m * count_of_laps; along_m += kScan_m) {
    truth.push_back(on_circle(along_m));
    model::LandmarkScan scan = sim::observe(simulated.forest(), simulated.grid(),
                                            world_T_start * truth.back(), drive.sensor, random)
                                   .scan;
    scan.utime = static_cast<model::Utime>(truth.size()) * 100'000;
    scan.sequence = truth.size();
    if (const auto keyframe = keyframer.add(scan)) {
      const model::MapUpdate update = mapper.add(*keyframe);
      const bool is_taken = update.status == model::MapUpdateStatus::kUpdated ||
                            update.status == model::MapUpdateStatus::kFirstMap;
      REQUIRE(is_taken);
      if (along_m > 0.5 * kLap_m * count_of_laps)
        count(update, truth[static_cast<std::size_t>(update.utime / 100'000) - 1], laps);
    }
    if (along_m + kScan_m >= kLap_m * static_cast<double>(laps.state_bytes.size() + 1))
      laps.state_bytes.push_back(mapper.save().size());
  }
  laps.landmarks = mapper.landmarks().size();
  return laps;
}

const Eigen::Matrix2d kInformation = 1e4 * Eigen::Matrix2d::Identity();

CentreMotion motion_between(NodeIndex from, NodeIndex to, const PoseGraph& graph, double bias) {
  CentreMotion motion;
  motion.from = from;
  motion.utime = 1'000'000 * (to + 1);
  motion.from_T_to = {graph.pose(from).inverse() * graph.pose(to),
                      1e-4 * Eigen::Matrix3d::Identity()};
  motion.gyro = model::GyroRotation{motion.from_T_to.mean.theta() + bias, 1e-6, 1.0, 0.0};
  return motion;
}

/// Three passes of `nodes` nodes each along a row of trunks, one after the other; noisy, solved.
PoseGraph three_passes(NodeIndex nodes, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.01);
  SmoothingMapperParameters parameters;
  parameters.gyro_walk = 1e-5;
  PoseGraph graph(parameters);
  for (NodeIndex i = 0; i < 3 * nodes; ++i) {
    const auto pass = static_cast<double>(i / nodes);
    const double along_m = 2.0 * (i % nodes) + 0.7 * pass;
    graph.add_node({along_m, 0.3 * pass, 0.0}, false, i == 0);
    if (i > 0) graph.add_motion(motion_between(i - 1, i, graph, 1e-3), i);
    for (model::LandmarkId id = 1; id <= 12; ++id) {
      const Eigen::Vector2d trunk(3.0 * static_cast<double>(id) - 6.0, id % 2 == 0 ? 5.0 : -4.0);
      if (i == 0) graph.add_landmark(id, trunk, std::nullopt);
      if (std::abs(trunk.x() - along_m) > 12.0) continue;
      const Eigen::Vector2d seen = graph.pose(i).inverse() * trunk;
      graph.observe(i, id, seen + Eigen::Vector2d(noise(random), noise(random)), kInformation);
    }
  }
  REQUIRE(graph.solve().ok);
  return graph;
}

/// All of a pass but its last node: loose where it is the second one, else into the pass before.
Surplus pass_of(NodeIndex first, NodeIndex nodes, const PoseGraph& graph) {
  Surplus surplus;
  for (NodeIndex i = first; i + 1 < first + nodes; ++i) {
    if (first == nodes) {
      surplus.loose.push_back(i);
    } else {
      surplus.nodes.push_back({i, i - nodes, *graph.relative(i - nodes, i)});
    }
  }
  return surplus;
}

void take_passes_out(NodeIndex nodes, PoseGraph& graph) {
  for (const NodeIndex first : {nodes, 2 * nodes}) {
    graph.take_out(pass_of(first, nodes, graph));
    REQUIRE(graph.solve().ok);
  }
}

std::vector<model::LandmarkId> landmarks_of(NodeIndex node, const PoseGraph& graph) {
  std::vector<model::LandmarkId> ids;
  for (const auto& [id, factor] : graph.node(node).observations()) ids.push_back(id);
  return ids;
}

}  // namespace

TEST_CASE("Laps on known ground do not grow the map, and cost no accuracy", "[mapper]") {
  Laps bounded;
  Laps whole;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Laps one = drive_laps(5.0, 8, seed);
    const Laps other = drive_laps(0.0, 8, seed);
    // After two laps there are only poses to be added, for a while.
    const std::size_t per_lap = (one.state_bytes[7] - one.state_bytes[2]) / 5;
    CHECK(per_lap < one.state_bytes[2] / 25);
    CHECK(other.state_bytes[7] - other.state_bytes[6] > other.state_bytes[2] / 5);
    CHECK(one.landmarks <= other.landmarks + 2);

    for (const auto& [sum, laps] : {std::pair(&bounded, &one), std::pair(&whole, &other)}) {
      sum->squared_m2 += laps->squared_m2;
      sum->nees += laps->nees;
      sum->poses += laps->poses;
    }
  }
  CHECK(bounded.rms_m() < 1.1 * whole.rms_m());
  CHECK(bounded.mean_nees() < 1.3 * whole.mean_nees());
  CHECK(bounded.mean_nees() < 3.5);
}

TEST_CASE("What nodes that go observed stays in the map, and no more than that", "[mapper]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    constexpr NodeIndex kNodes = 9;
    PoseGraph graph = three_passes(kNodes, seed);
    const NodeIndex newest = 3 * kNodes - 1;
    const std::vector<model::LandmarkId> seen = landmarks_of(newest, graph);
    const std::vector<double> before = graph.relative_variances(newest, seen);
    const geometry::SE2WithCovariance pose = graph.marginal(newest);

    take_passes_out(kNodes, graph);
    CHECK(graph.node_count() == 2 * kNodes + 1);

    // The newest pose is where it was, known nearly as well.
    const geometry::SE2WithCovariance now = graph.marginal(newest);
    const Eigen::Vector3d moved = (pose.mean.inverse() * now.mean).Log();
    CHECK(moved.dot(pose.covariance.inverse() * moved) < 0.3);
    for (int i = 0; i < 3; ++i) {
      CHECK(now.covariance(i, i) < 1.3 * pose.covariance(i, i));
      CHECK(now.covariance(i, i) > 0.97 * pose.covariance(i, i));
    }
    const std::vector<double> after = graph.relative_variances(newest, seen);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      CHECK(after[i] > 0.95 * before[i]);
      CHECK(after[i] < 1.3 * before[i]);
    }
  }
}

TEST_CASE("Numbers of nodes that went serve again, and a rollback takes all back", "[mapper]") {
  constexpr NodeIndex kNodes = 9;
  PoseGraph graph = three_passes(kNodes, 7);
  const std::string before = state::save({"graph"}, graph);
  graph.checkpoint();
  take_passes_out(kNodes, graph);
  REQUIRE(state::save({"graph"}, graph) != before);
  graph.rollback();
  CHECK(state::save({"graph"}, graph) == before);

  take_passes_out(kNodes, graph);
  const std::size_t bytes = state::save({"graph"}, graph).size();
  const std::string taken_out = state::save({"graph"}, graph);

  // A new pass, refused and then taken: the same numbers, no more bytes but those of its factors.
  for (const bool is_refused : {true, false}) {
    graph.checkpoint();
    NodeIndex last = 3 * kNodes - 1;
    for (NodeIndex i = 0; i + 1 < kNodes; ++i) {
      const NodeIndex node = graph.add_node({2.0 * i, -0.2, 0.0}, false);
      CHECK(node < 3 * kNodes);
      graph.add_motion(motion_between(last, node, graph, 1e-3), node);
      for (const model::LandmarkId id : landmarks_of(i, graph))
        graph.observe(node, id, graph.pose(node).inverse() * *graph.position(id), kInformation);
      last = node;
    }
    REQUIRE(graph.solve().ok);
    if (!is_refused) break;
    graph.rollback();
    CHECK(state::save({"graph"}, graph) == taken_out);
  }
  CHECK(graph.node_count() == 3 * kNodes);
  const std::size_t pass = before.size() - bytes + 4096;
  CHECK(state::save({"graph"}, graph).size() < bytes + pass);

  // A loaded graph goes on with the same free numbers.
  PoseGraph loaded(SmoothingMapperParameters{});
  state::load(taken_out, {"graph"}, loaded);
  CHECK(loaded.node_count() == 2 * kNodes + 1);
  CHECK(loaded.add_node({}, false) < 3 * kNodes);
}

TEST_CASE("The gyro's bias is still known when the motions that told it are gone", "[mapper]") {
  constexpr NodeIndex kNodes = 12;
  PoseGraph graph = three_passes(kNodes, 3);
  const auto predicted_rad = [&](PoseGraph& from) {
    // Where the graph sees a further motion end whose landmarks are unknown.
    const NodeIndex newest = 3 * kNodes - 1;
    from.checkpoint();
    const NodeIndex node = from.add_node(from.pose(newest) * geometry::SE2(2.0, 0.0, 0.0), false);
    CentreMotion motion = motion_between(newest, node, from, 0.0);
    motion.gyro = model::GyroRotation{1e-2, 1e-6, 10.0, 0.0};
    from.add_motion(motion, node);
    REQUIRE(from.solve().ok);
    const auto relative = *from.relative(newest, node);
    from.rollback();
    return std::pair(relative.mean.theta(), std::sqrt(relative.covariance(2, 2)));
  };

  const auto [before_rad, before_sigma] = predicted_rad(graph);
  CHECK(std::abs(before_rad) < 3.0 * before_sigma);
  take_passes_out(kNodes, graph);
  const auto [after_rad, after_sigma] = predicted_rad(graph);
  CHECK(std::abs(after_rad - before_rad) < before_sigma);
  CHECK(after_sigma < 1.3 * before_sigma);
  CHECK(after_sigma > 0.8 * before_sigma);
}

TEST_CASE("Free numbers come back in the order in which a rollback leaves them", "[mapper]") {
  std::mt19937_64 random(5);
  FreeNumbers free;
  std::uint32_t next = 0;
  for (int trial = 0; trial < 200; ++trial) {
    free.checkpoint();
    const std::string before = state::save({"free"}, free);
    for (int i = 0; i < 20; ++i) {
      if (random() % 2 == 0) {
        free.give(next++);
      } else {
        free.take();
      }
    }
    if (random() % 2 == 0) continue;
    free.rollback();
    REQUIRE(state::save({"free"}, free) == before);
  }
  REQUIRE(free.size() > 0);
}

TEST_CASE("A vehicle that stands for days keeps the last poses alone", "[mapper]") {
  SmoothingMapperParameters parameters;
  GlobalMap map(parameters);
  const NodeIndex node = map.graph.add_node({}, true, true);
  model::Keyframe keyframe;
  keyframe.members.push_back({0, 0, {}, Eigen::Matrix3d::Zero()});
  for (std::uint64_t i = 0; i < 3 * Trajectory::kMostSpare; ++i) {
    keyframe.sequence = i;
    map.trajectory.add(base_of(keyframe, node), map.graph);
    REQUIRE(map.trajectory.bases().size() < Trajectory::kMostSpare + 300);
    REQUIRE(map.trajectory.last().sequence == i);
  }
  CHECK(map.trajectory.size() == 3 * Trajectory::kMostSpare);
  CHECK(map.trajectory.bases().size() > Trajectory::kMostSpare - 300);
  CHECK(map.trajectory.bases().front().sequence == 0);  // the viewpoint

  const std::string state = state::save({"trajectory"}, map.trajectory);
  Trajectory loaded(parameters);
  state::load(state, {"trajectory"}, loaded);
  loaded.rebuild_index(map.graph);
  for (std::uint64_t i = 0; i < 600; ++i) {
    loaded.add(base_of(keyframe, node), map.graph);
    map.trajectory.add(base_of(keyframe, node), map.graph);
  }
  CHECK(state::save({"trajectory"}, loaded) == state::save({"trajectory"}, map.trajectory));
}

TEST_CASE("A vehicle that drives known ground for days keeps the last poses alone", "[mapper]") {
  SmoothingMapperParameters parameters;
  GlobalMap map(parameters);
  const NodeIndex old = map.graph.add_node({}, false, true);
  const NodeIndex passing = map.graph.add_node({1.0, 0.0, 0.0}, false);
  const geometry::SE2WithCovariance old_T_passing{{1.0, 0.0, 0.0}, Eigen::Matrix3d::Zero()};
  model::Keyframe keyframe;
  keyframe.members.push_back({0, 0, {}, Eigen::Matrix3d::Zero()});
  map.trajectory.add(base_of(keyframe, old), map.graph);
  for (std::uint64_t i = 1; i < 2 * Trajectory::kMostSpare; ++i) {
    keyframe.sequence = i;
    map.trajectory.add(base_of(keyframe, passing), map.graph);
    REQUIRE(map.trajectory.pose(map.trajectory.last(), map.graph).x() == Approx(1.0));
    map.trajectory.hand_over({passing, old, old_T_passing});
    REQUIRE(map.trajectory.pose(map.trajectory.last(), map.graph).x() == Approx(1.0));
    REQUIRE(map.trajectory.bases().size() < Trajectory::kMostSpare + 300);
  }
  CHECK(map.trajectory.bases().front().sequence == 0);  // the viewpoint
  CHECK(map.trajectory.size() == 2 * Trajectory::kMostSpare);
}
