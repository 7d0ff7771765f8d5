// Landmarks that become one, and two again.
#include <random>

#include "services/geoslam_mapper/smoothing/doubles.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kSigma_m = 0.05;

/// Two passes along a row of trunks, `gap_m` of path between them; each trunk has a landmark of
/// each pass: `first` + i and `second` + i. Motions tie all nodes together.
struct TwoPasses {
  GlobalMap map{SmoothingMapperParameters{}};
  std::vector<Eigen::Vector2d> trunks;
  std::vector<model::LandmarkId> first;
  std::vector<model::LandmarkId> second;

  explicit TwoPasses(std::uint64_t seed) : random(seed) {
    for (int i = 0; i < 12; ++i) trunks.emplace_back(5.0 * i, i % 2 == 0 ? 6.0 : -7.0);
    trunks.emplace_back(trunks[5] + Eigen::Vector2d(0.5, 0.5));  // a near neighbour
    drive(0.0, 1.0, first);
    for (double back = 1.0; back < 30.0; back += 1.0) step({60.0 - 2.0 * back, 30.0, 0.0});
    drive(0.5, 1.0, second);
    REQUIRE(map.graph.solve().ok);
    map.adopt_estimates();
  }

  /// A landmark as the graph and the map have it, observed from the last node.
  void observe(model::LandmarkId id, const Eigen::Vector2d& position_m) {
    const NodeIndex node = *map.graph.newest();
    const Eigen::Vector2d noise(kSigma_m * unit(random), kSigma_m * unit(random));
    map.graph.observe(node, id, map_T_true.inverse() * position_m + noise,
                      Eigen::Matrix2d::Identity() / (kSigma_m * kSigma_m));
    map.landmarks.at(id).observed_from(node);
    map.landmarks.at(id).viewed_at(map.graph.node(node).along_m);
    map.landmarks.at(id).information += 1.0 / (kSigma_m * kSigma_m);
  }

  void step(const geometry::SE2& pose) {
    const bool is_first = !map.graph.newest();
    CentreMotion motion;
    if (!is_first) {
      motion.from = *map.graph.newest();
      motion.from_T_to = {map_T_true.inverse() * pose,
                          Eigen::Vector3d(1e-5, 1e-5, 1e-8).asDiagonal()};
    }
    map_T_true = pose;
    const NodeIndex node = map.graph.add_node(pose, false, is_first);
    if (!is_first) map.graph.add_motion(motion, node);
  }

  std::mt19937_64 random;
  std::normal_distribution<double> unit{0.0, 1.0};
  geometry::SE2 map_T_true;

 private:
  void drive(double begin_m, double beside_m, std::vector<model::LandmarkId>& ids) {
    for (double along_m = begin_m; along_m < 60.0; along_m += 2.0) {
      step({along_m, beside_m, 0.0});
      for (std::size_t i = 0; i < trunks.size(); ++i) {
        if (ids.size() == i) {
          StoredLandmark landmark;
          landmark.position_m = trunks[i];
          ids.push_back(map.landmarks.insert(landmark));
          map.graph.add_landmark(ids[i], trunks[i], std::nullopt);
        }
        if ((trunks[i] - map_T_true.translation()).norm() < 20.0 ||
            map.landmarks.at(ids[i]).nodes.empty())
          observe(ids[i], trunks[i]);
      }
    }
  }
};

}  // namespace

TEST_CASE("Doubles of two passes are merged, neighbours are not", "[merging]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    TwoPasses world(seed);
    SmoothingMapperParameters parameters;
    Merges merges;
    const auto merged = merge_doubles(world.second, parameters, merges, world.map);
    CHECK(merged.size() >= 11);
    for (const auto& [old_id, new_id] : merged) {
      const auto a = std::find(world.first.begin(), world.first.end(), std::min(old_id, new_id));
      const auto b = std::find(world.second.begin(), world.second.end(), std::max(old_id, new_id));
      REQUIRE(a != world.first.end());
      REQUIRE(b != world.second.end());
      CHECK(a - world.first.begin() == b - world.second.begin());
    }
  }
}

TEST_CASE("A merge of two trunks is taken back, a right one stays", "[merging]") {
  TwoPasses world(4);
  Merges merges;
  const std::size_t before = world.map.landmarks.all().size();
  merges.merge({world.first[3], world.second[3]}, false, world.map);
  merges.merge({world.first[5], world.second[12]}, false, world.map);
  REQUIRE(world.map.graph.solve().ok);
  world.map.adopt_estimates();
  REQUIRE(world.map.landmarks.all().size() == before - 2);

  const std::vector<model::Association> touched{{0, world.second[3]}, {1, world.second[12]}};
  const std::optional<model::LandmarkId> separated = merges.take_back(touched, world.map);
  REQUIRE(separated);
  CHECK(*separated != world.first[5]);  // an id never comes back
  REQUIRE(world.map.graph.solve().ok);
  world.map.adopt_estimates();

  CHECK((world.map.landmarks.at(*separated).position_m - world.trunks[5]).norm() < 0.15);
  CHECK((world.map.landmarks.at(world.second[12]).position_m - world.trunks[12]).norm() < 0.15);
  CHECK((world.map.landmarks.at(world.second[3]).position_m - world.trunks[3]).norm() < 0.15);
  CHECK(merges.were_separated(world.second[12], *separated));
  CHECK_FALSE(merges.take_back(touched, world.map));

  // It finds its true double, not the one that it was taken from.
  const auto again = merge_doubles({{*separated}}, {}, merges, world.map);
  REQUIRE(again.size() == 1);
  CHECK(std::min(again[0].first, again[0].second) == std::min(world.second[5], *separated));
}

TEST_CASE("Landmarks joined in vain are as before after a rollback", "[merging]") {
  TwoPasses world(5);
  PoseGraph& graph = world.map.graph;
  std::vector<Eigen::Vector2d> positions;
  for (const auto& [id, landmark] : world.map.landmarks.all())
    positions.push_back(*graph.position(id));

  graph.checkpoint();
  for (std::size_t i = 0; i + 1 < world.trunks.size(); ++i)
    graph.hand_over(world.first[i], world.second[i + 1],
                    world.map.landmarks.at(world.first[i]).nodes);
  REQUIRE(graph.solve().ok);
  CHECK_FALSE(graph.position(world.first[0]));
  graph.rollback();

  std::size_t i = 0;
  for (const auto& [id, landmark] : world.map.landmarks.all()) {
    REQUIRE(graph.position(id));
    CHECK(*graph.position(id) == positions[i++]);
    for (const NodeIndex node : landmark.nodes) CHECK(graph.node(node).observations().contains(id));
  }
  REQUIRE(graph.solve().ok);
  CHECK((*graph.position(world.first[2]) - positions[2]).norm() < 1e-3);
}
