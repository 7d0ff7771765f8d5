// The life of a track: begun, matched, merged with its double, dropped.
#include <algorithm>
#include <random>

#include "services/keyframer/joint/local_map.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer::joint;

namespace {

/// Detections at these places, 0.1 m uncertain per axis.
model::LandmarkScan scan_of(const std::vector<Eigen::Vector2d>& places) {
  model::LandmarkScan scan;
  scan.field_of_view.max_range_m = 40.0;
  for (const Eigen::Vector2d& place : places) {
    model::Detection& detection = scan.detections.emplace_back();
    detection.position_m << place, 0.0;
    detection.covariance_m2 = 0.01 * Eigen::Matrix3d::Identity();
  }
  return scan;
}

/// Those within the noise of an older one and never detected with it, by trying all pairs.
std::vector<TrackNumber> doubtful_by_force(const LocalMap& map, std::vector<TrackNumber> ids) {
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::vector<TrackNumber> doubtful;
  for (const TrackNumber young : ids) {
    const Track* b = map.find(young);
    if (b == nullptr) continue;
    const bool is_doubtful = std::ranges::any_of(ids, [&](TrackNumber old) {
      const Track* a = map.find(old);
      if (a == nullptr || old >= young || (a->detected_bits & b->detected_bits) != 0) return false;
      const double gate2 = 16.0 * std::max(a->detection_variance_m2, b->detection_variance_m2);
      return (a->position_m - b->position_m).squaredNorm() <= std::min(gate2, 4.0);
    });
    if (is_doubtful) doubtful.push_back(young);
  }
  return doubtful;
}

}  // namespace

TEST_CASE("A matched detection updates its track, another one begins one", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto first = map.add(scan_of({{10.0, 0.0}}), {}, {});
  const std::vector<geometry::PointPair> pairs{{0, 1}};
  const auto second = map.add(scan_of({{0.0, 20.0}, {10.2, 0.0}}), pairs, {});
  REQUIRE(second[1] == first[0]);
  REQUIRE(second[0] != first[0]);
  const Track* track = map.find(first[0]);
  REQUIRE(track != nullptr);
  CHECK(track->observations == 2);
  CHECK((track->position_m - Eigen::Vector2d(10.1, 0.0)).norm() < 1e-12);
  CHECK(track->detected_bits == 0b11);
  CHECK(map.find(second[0])->detected_bits == 0b1);
}

TEST_CASE("A scan can match what is in view, or everything after one scan", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto scan = scan_of({{10.0, 0.0}, {30.0, 0.0}});
  map.add(scan, {}, {});
  const model::FieldOfView near{.max_range_m = 20.0};
  CHECK(map.matchable({}, near) == 2);
  const std::vector<geometry::PointPair> pairs{{0, 0}, {1, 1}};
  map.add(scan, pairs, {});
  CHECK(map.matchable({}, near) == 1);
  CHECK(map.matchable(geometry::SE2(20.0, 0.0, 0.0), near) == 2);
}

TEST_CASE("Two tracks that are never detected together become one", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto first = map.add(scan_of({{10.0, 0.0}}), {}, {});
  const auto second = map.add(scan_of({{10.3, 0.0}}), {}, {});
  REQUIRE(map.find(second[0]) != nullptr);
  CHECK(map.doubtful() == second);

  // Detected in turns, until both were in view often enough.
  const std::vector<geometry::PointPair> to_first{{0, 0}};
  const std::vector<geometry::PointPair> to_second{{1, 0}};
  for (int k = 0; k < 3; ++k) {
    map.add(scan_of({{10.0, 0.0}}), to_first, {});
    if (map.find(second[0]) != nullptr) map.add(scan_of({{10.3, 0.0}}), to_second, {});
  }
  CHECK(map.find(second[0]) == nullptr);
  CHECK(map.resolved(second) == first);
  CHECK(map.find(first[0])->observations >= 7);
}

TEST_CASE("Two tracks that are detected together stay two", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto scan = scan_of({{10.0, 0.0}, {10.3, 0.0}});
  const auto tracks = map.add(scan, {}, {});
  const std::vector<geometry::PointPair> pairs{{0, 0}, {1, 1}};
  for (int k = 0; k < 10; ++k) map.add(scan, pairs, {});
  REQUIRE(map.find(tracks[1]) != nullptr);
  CHECK(map.doubtful().empty());
}

TEST_CASE("A track out of range is dropped, and its number is not used again", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto first = map.add(scan_of({{10.0, 0.0}}), {}, {});
  const geometry::SE2 far(75.0, 0.0, 0.0);
  const auto second = map.add(scan_of({{10.0, 0.0}}), {}, far);
  CHECK(map.find(first[0]) == nullptr);
  CHECK(second[0] > first[0]);
  map.clear();
  CHECK(map.add(scan_of({{10.0, 0.0}}), {}, {})[0] > second[0]);
}

TEST_CASE("Doubtful tracks are those that trying all pairs finds", "[keyframer][map]") {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  LocalMap map(4.0);
  std::vector<TrackNumber> ids;
  for (int scan = 0; scan < 5; ++scan) {
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i < 200; ++i) places.emplace_back(place(random), place(random));
    const auto added = map.add(scan_of(places), {}, {});
    ids.insert(ids.end(), added.begin(), added.end());
    const auto expected = doubtful_by_force(map, ids);
    REQUIRE(map.doubtful() == expected);
    if (scan > 0) CHECK(expected.size() > 10);
  }
}

TEST_CASE("The map is bounded, even where nothing is ever in view", "[keyframer][map]") {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-30.0, 30.0);
  LocalMap map(4.0);
  for (int scan = 0; scan < 12; ++scan) {
    std::vector<Eigen::Vector2d> places;
    for (int i = 0; i < 2000; ++i) places.emplace_back(place(random), place(random));
    auto unseen = scan_of(places);
    unseen.field_of_view.width_rad = 1e-6;
    const auto added = map.add(unseen, {}, {});
    CHECK(map.reference_points().size() <= LocalMap::kMostTracks);
    CHECK(map.find(added.front()) != nullptr);  // The newest stay.
    CHECK(map.find(added.back()) != nullptr);
  }
  CHECK(map.doubtful().size() > 0);
}

TEST_CASE("A track that is not detected again in 16 views was noise", "[keyframer][map]") {
  LocalMap map(4.0);
  const auto tracks = map.add(scan_of({{10.0, 0.0}, {0.0, 10.0}}), {}, {});
  const std::vector<geometry::PointPair> to_first{{0, 0}};
  for (int k = 1; k < 16; ++k) map.add(scan_of({{10.0, 0.0}}), to_first, {});
  CHECK(map.find(tracks[1]) != nullptr);
  map.add(scan_of({{10.0, 0.0}}), to_first, {});
  CHECK(map.find(tracks[1]) == nullptr);
  CHECK(map.find(tracks[0]) != nullptr);
}
