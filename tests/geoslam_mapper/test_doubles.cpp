// Which landmarks are one and the same.
#include "services/geoslam_mapper/smoothing/doubles.hpp"

#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

const Eigen::Matrix2d kInformation = 1e4 * Eigen::Matrix2d::Identity();

/// A row of nodes past two landmarks that are near to each other.
struct TwoLandmarks {
  SmoothingMapperParameters parameters;
  GlobalMap map{parameters};
  model::LandmarkId first = 0;
  model::LandmarkId second = 0;

  /// `together` nodes observe both, `apart` each of them.
  TwoLandmarks(int together, int apart, double distance_m) {
    StoredLandmark landmark;
    landmark.position_m << 5.0, 4.0;
    landmark.information = 1e4;
    first = map.landmarks.insert(landmark);
    landmark.position_m.x() += distance_m;
    second = map.landmarks.insert(landmark);
    for (const model::LandmarkId id : {first, second})
      map.graph.add_landmark(id, map.landmarks.at(id).position_m, std::nullopt);
    // Two others, far off, tie the nodes together.
    const std::vector<std::pair<model::LandmarkId, Eigen::Vector2d>> others{{1, {-20.0, 15.0}},
                                                                            {2, {40.0, -15.0}}};
    for (const auto& [id, position_m] : others)
      map.graph.add_landmark(id, position_m, std::nullopt);
    for (int k = 0; k < together + 2 * apart; ++k) {
      const NodeIndex node = map.graph.add_node({0.5 * k, 0.0, 0.0}, false, k == 0);
      for (const auto& [id, position_m] : others)
        map.graph.observe(node, id, map.graph.pose(node).inverse() * position_m, kInformation);
      if (k < together || k % 2 == 0) observe(node, first);
      if (k < together || k % 2 == 1) observe(node, second);
    }
    REQUIRE(map.graph.solve().ok);
  }

  void observe(NodeIndex node, model::LandmarkId id) {
    StoredLandmark& landmark = map.landmarks.at(id);
    map.graph.observe(node, id, map.graph.pose(node).inverse() * landmark.position_m, kInformation);
    landmark.observed_from(node);
    landmark.viewed_at(map.graph.node(node).along_m);
    ++landmark.observation_count;
  }

  bool merges() {
    Merges merges;
    return !merge_doubles(std::vector{first}, parameters, merges, map).empty();
  }
};

}  // namespace

TEST_CASE("Landmarks that are side by side more than once are two", "[mapper]") {
  const double near_m = 0.5 * SmoothingMapperParameters{}.merge_distance_m;
  for (const int apart : {10, 30}) {
    CAPTURE(apart);
    CHECK(TwoLandmarks(0, apart, near_m).merges());
    CHECK(TwoLandmarks(1, apart, near_m).merges());
    for (const int together : {2, 3, 4, 5, 8}) {
      CAPTURE(together);
      CHECK_FALSE(TwoLandmarks(together, apart, near_m).merges());
    }
  }
  // A few sightings in turns happen by chance.
  for (const int apart : {1, 2, 3}) {
    CAPTURE(apart);
    CHECK_FALSE(TwoLandmarks(0, apart, near_m).merges());
    CHECK_FALSE(TwoLandmarks(1, apart, near_m).merges());
  }
}

TEST_CASE("Landmarks farther apart than the merging distance are two", "[mapper]") {
  const double limit_m = SmoothingMapperParameters{}.merge_distance_m;
  CHECK(TwoLandmarks(0, 10, 0.99 * limit_m).merges());
  CHECK_FALSE(TwoLandmarks(0, 10, 1.01 * limit_m).merges());
}
