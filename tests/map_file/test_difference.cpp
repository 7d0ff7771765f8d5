// What moved from one map to another.
#include "common/map_file/difference.hpp"

#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

StoredMap map_of_points(const std::vector<std::pair<std::uint64_t, double>>& points,
                        double sigma_m) {
  StoredMap map;
  for (const auto& [counter, x] : points) {
    map_file::StoredLandmark one;
    one.landmark.id = map_file::landmark_id(1, counter);
    one.landmark.position_m.x() = x;
    one.landmark.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix2d::Identity();
    map.landmarks.push_back(one);
  }
  return map;
}

}  // namespace

TEST_CASE("landmarks are added, removed, moved beyond the quantile, kept", "[map_file]") {
  // chi2 of the way: 0.2^2 / (2 * 0.1^2) = 2, 0.5^2 / (2 * 0.1^2) = 12.5; the 99 % quantile
  // is 9.21.
  const StoredMap before = map_of_points({{1, 0.0}, {2, 10.0}, {3, 20.0}, {5, 30.0}}, 0.1);
  const StoredMap after = map_of_points({{2, 10.2}, {3, 20.5}, {4, 1.0}, {5, 30.0}}, 0.1);
  const auto found = map_file::difference(before, after, {.quantile = 0.99});
  CHECK(found.added == std::vector{map_file::landmark_id(1, 4)});
  CHECK(found.removed == std::vector{map_file::landmark_id(1, 1)});
  REQUIRE(found.moved.size() == 1);
  CHECK(found.moved[0].id == map_file::landmark_id(1, 3));
  CHECK(found.moved[0].distance_m == Approx(0.5));
  CHECK(found.moved[0].chi2 == Approx(12.5));
  CHECK(found.kept == 2);

  CHECK(map_file::difference(before, after, {.quantile = 0.999}).moved.empty());
  CHECK(map_file::difference(before, after, {.quantile = 0.5}).moved.size() == 2);
  CHECK(map_file::chi2_of_quantile(0.99) == Approx(9.2103).margin(1e-3));
}

TEST_CASE("without covariances any move counts", "[map_file]") {
  const auto found =
      map_file::difference(map_of_points({{1, 0.0}, {2, 1.0}}, 0.0),
                           map_of_points({{1, 1e-6}, {2, 1.0}}, 0.0), {.quantile = 0.999});
  REQUIRE(found.moved.size() == 1);
  CHECK(std::isinf(found.moved[0].chi2));
  CHECK(found.kept == 1);

  // Or one is given for them: here to one of two.
  const auto given = map_file::difference(map_of_points({{1, 0.0}}, 0.3),
                                          map_of_points({{1, 1.0}}, 0.0), {0.1, 0.4});
  REQUIRE(given.moved.size() == 1);
  CHECK(given.moved[0].chi2 == Approx(4.0));
}

TEST_CASE("as many landmarks move as the quantile says, where errors are as stated", "[map_file]") {
  std::mt19937_64 random(23);
  std::normal_distribution<double> normal;
  const std::size_t count = 20'000;
  StoredMap before;
  StoredMap after;
  for (std::size_t i = 1; i <= count; ++i) {
    for (StoredMap* const map : {&before, &after}) {
      map_file::StoredLandmark one;
      one.landmark.id = map_file::landmark_id(1, i);
      Eigen::Matrix2d root;
      root << 0.1, 0.0, 0.05, 0.2;
      const double x = normal(random);
      one.landmark.position_m = root * Eigen::Vector2d(x, normal(random));
      one.landmark.covariance_m2 = root * root.transpose();
      map->landmarks.push_back(one);
    }
  }
  const auto moved = map_file::difference(before, after, {.quantile = 0.95}).moved.size();
  CHECK(static_cast<double>(moved) == Approx(0.05 * count).margin(5.0 * std::sqrt(0.05 * count)));
}

namespace {

/// The landmarks of `use` have a state, those of `probabilities` have one of these.
StoredMap map_with_existence(const std::vector<std::pair<std::uint64_t, bool>>& use,
                             const std::vector<double>& probabilities) {
  StoredMap map = map_of_points({{1, 0.0}, {2, 10.0}, {3, 20.0}, {4, 30.0}}, 0.1);
  map_file::StoredExistence existence{1, "learned", {}};
  for (std::size_t i = 0; i < use.size(); ++i) {
    const model::LandmarkId id = map_file::landmark_id(1, use[i].first);
    existence.landmarks.push_back({{id, probabilities[i], use[i].second}, 1, "state"});
  }
  map_file::give_existence(map, existence);
  return map;
}

}  // namespace

TEST_CASE("landmarks that left use, that are used again, and those of another probability",
          "[map_file]") {
  const StoredMap before =
      map_with_existence({{1, true}, {2, false}, {3, true}, {4, true}}, {0.99, 0.05, 0.9, 0.9});
  const StoredMap after =
      map_with_existence({{1, false}, {2, true}, {3, true}, {4, true}}, {0.02, 0.95, 0.7, 0.85});
  const auto found = map_file::difference(before, after, {});
  CHECK(found.kept == 4);
  REQUIRE(found.existence.size() == 3);
  CHECK(found.existence[0].id == map_file::landmark_id(1, 1));
  CHECK(found.existence[0].was_in_use);
  CHECK_FALSE(found.existence[0].is_in_use);
  CHECK(found.existence[0].probability_before == 0.99);
  CHECK(found.existence[0].probability_after == 0.02);
  CHECK_FALSE(found.existence[1].was_in_use);
  CHECK(found.existence[1].is_in_use);
  CHECK(found.existence[2].id == map_file::landmark_id(1, 3));
  CHECK(found.existence[2].is_in_use);
  CHECK(map_file::difference(before, after, {.probability_change = 0.01}).existence.size() == 4);
  CHECK(map_file::difference(before, after, {.probability_change = 1.0}).existence.size() == 2);

  // Of a map without states all are in use, and nothing is known of them.
  const auto first = map_file::difference(map_with_existence({}, {}), after, {});
  REQUIRE(first.existence.size() == 1);
  CHECK(first.existence[0].id == map_file::landmark_id(1, 1));
  CHECK_FALSE(first.existence[0].probability_before);
}

TEST_CASE("what a file knew of existence before its last change is there after a revert",
          "[map_file]") {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory / "now.gpkg";
  const std::filesystem::path earlier = directory / "earlier.gpkg";
  const StoredMap before = map_with_existence({{1, true}}, {0.99});
  const StoredMap after = map_with_existence({{1, false}}, {0.02});
  map_file::create_map_file(file, {&before, 1}, note("a drive"));
  const std::uint64_t first = MapFile(file, Access::kRead).history().size();
  MapFile(file, Access::kWrite).put({&after, 1}, note("another drive"));
  std::filesystem::copy_file(file, earlier);
  MapFile(earlier, Access::kWrite).revert(first, note("back"));

  const auto found = map_file::difference(MapFile(earlier, Access::kRead).read(1),
                                          MapFile(file, Access::kRead).read(1), {});
  REQUIRE(found.existence.size() == 1);
  CHECK(found.existence[0].was_in_use);
  CHECK_FALSE(found.existence[0].is_in_use);
}
