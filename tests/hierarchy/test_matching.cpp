#include <set>

#include "common/hierarchy/matching.hpp"
#include "tests/catch.hpp"
#include "tests/hierarchy/hierarchy_scene.hpp"

using namespace understory;
using namespace understory::hierarchy;

namespace {

struct Tally {
  std::size_t right = 0;
  std::size_t wrong = 0;
};

Tally judge(const std::vector<LandmarkMatch>& pairs) {
  Tally tally;
  for (const LandmarkMatch& pair : pairs) {
    ++(pair.query_id == pair.map_id ? tally.right : tally.wrong);
  }
  return tally;
}

/// Landmark ids along each polygon's boundary, in lexicographic order.
std::vector<std::vector<std::uint64_t>> polygon_ids(const GeometricHierarchy& hierarchy) {
  std::vector<std::vector<std::uint64_t>> result;
  for (const Polygon& polygon : hierarchy.polygons()) {
    if (!polygon.exists()) continue;
    auto& ids = result.emplace_back();
    for (const std::uint32_t slot : polygon.boundary)
      ids.push_back(hierarchy.triangulation().id(slot));
  }
  std::sort(result.begin(), result.end());
  return result;
}

geometry::SE2 random_pose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  return {100.0 * unit(random), 100.0 * unit(random), 3.1 * unit(random)};
}

}  // namespace

TEST_CASE("A view without noise matches all of its inner polygons rightly", "[hierarchy]") {
  std::mt19937_64 random(31);
  const auto forest = test::random_forest(1200, random);
  const GeometricHierarchy map(forest);
  const test::View view{.noise_m = 0.0, .detection = 1.0};

  for (int trial = 0; trial < 20; ++trial) {
    const GeometricHierarchy query(observe(forest, random_pose(random), view, random));

    // A polygon of the query exists in the map as well or has been changed by the end of the view.
    const auto in_map = polygon_ids(map);
    std::set<std::uint64_t> findable;
    for (const auto& ids : polygon_ids(query)) {
      if (std::binary_search(in_map.begin(), in_map.end(), ids)) {
        findable.insert(ids.begin(), ids.end());
      }
    }

    const auto pairs = match(query, map);
    std::set<std::uint64_t> found;
    for (const LandmarkMatch& pair : pairs) {
      if (pair.query_id == pair.map_id) {
        found.insert(pair.query_id);
      }
    }

    REQUIRE(findable.size() > 15);
    for (const std::uint64_t id : findable) {
      REQUIRE(found.contains(id));
    }

    REQUIRE(judge(pairs).wrong <= pairs.size() / 5);
  }
}

TEST_CASE("Missed, false and noisy landmarks leave enough right pairs", "[hierarchy]") {
  std::mt19937_64 random(32);
  const auto forest = test::random_forest(1200, random);
  const GeometricHierarchy map(forest);
  const test::View view{.noise_m = 0.05, .detection = 0.9, .clutter = 0.03};
  int places_found = 0;
  Tally sum;

  for (int trial = 0; trial < 50; ++trial) {
    const GeometricHierarchy query(observe(forest, random_pose(random), view, random));
    const Tally tally = judge(match(query, map));
    places_found += tally.right >= 6 ? 1 : 0;
    sum.right += tally.right;
    sum.wrong += tally.wrong;
  }

  REQUIRE(places_found >= 48);
  REQUIRE(sum.right > 3 * sum.wrong);
}

TEST_CASE("No landmark is in two pairs, and the best come first", "[hierarchy]") {
  std::mt19937_64 random(33);
  const auto forest = test::random_forest(1200, random);
  const GeometricHierarchy map(forest);
  const test::View view{.noise_m = 0.2, .detection = 0.8, .clutter = 0.2};
  std::size_t pairs_seen = 0;

  for (int trial = 0; trial < 30; ++trial) {
    const GeometricHierarchy query(observe(forest, random_pose(random), view, random));
    const auto pairs = match(query, map, {.max_descriptor_distance = 8.0});
    std::set<std::uint64_t> query_ids;
    std::set<std::uint64_t> map_ids;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      REQUIRE(query_ids.insert(pairs[i].query_id).second);
      REQUIRE(map_ids.insert(pairs[i].map_id).second);
      REQUIRE(pairs[i].score > 0.0);
      REQUIRE((i == 0 || pairs[i - 1].score >= pairs[i].score));
    }
    pairs_seen += pairs.size();
  }

  REQUIRE(pairs_seen > 100);
}

TEST_CASE("Polygon matches are those of a search through all pairs", "[hierarchy]") {
  std::mt19937_64 random(34);
  const auto forest = test::random_forest(1500, random);
  const GeometricHierarchy map(forest);
  const MatchParameters parameters{.max_descriptor_distance = 6.0};

  for (int trial = 0; trial < 10; ++trial) {
    const GeometricHierarchy query(observe(forest, random_pose(random), test::View{}, random));
    const auto nearest = [&](const Polygon& polygon, const GeometricHierarchy& among) {
      std::pair<float, std::uint32_t> best{6.0F, kNone};
      for (std::uint32_t p = 0; p < among.polygons().size(); ++p) {
        const Polygon& other = among.polygons()[p];
        const int difference =
            static_cast<int>(other.boundary.size()) - static_cast<int>(polygon.boundary.size());
        if (other.exists() && std::abs(difference) <= 3) {
          best = std::min(best, {distance(polygon.descriptor, other.descriptor), p});
        }
      }
      return best.second;
    };

    std::vector<std::pair<std::uint32_t, std::uint32_t>> expected;
    for (std::uint32_t q = 0; q < query.polygons().size(); ++q) {
      const std::uint32_t m = nearest(query.polygons()[q], map);
      if (m != kNone && nearest(map.polygons()[m], query) == q) {
        expected.emplace_back(q, m);
      }
    }

    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
    for (const PolygonMatch& match : match_polygons(query, map, parameters)) {
      found.emplace_back(match.query, match.map);
    }

    REQUIRE(found == expected);
    REQUIRE(found.size() > 3);
  }
}

TEST_CASE("A mirrored scene gives no pairs of its own", "[hierarchy]") {
  std::mt19937_64 random(35);
  const auto forest = test::random_forest(400, random);
  const GeometricHierarchy map(forest);
  const test::View view{.noise_m = 0.0, .detection = 1.0};
  std::size_t polygon_matches = 0;
  Tally sum;

  for (int trial = 0; trial < 10; ++trial) {
    auto seen = observe(forest, geometry::SE2(0.0, 0.0, 0.1 * trial), view, random);
    for (LandmarkPosition& landmark : seen) {
      landmark.position_m.x() = -landmark.position_m.x();
    }
    const GeometricHierarchy query(seen);
    // The descriptors are those of the unmirrored polygons; only the landmarks differ.
    polygon_matches += match_polygons(query, map).size();
    const Tally tally = judge(match(query, map));
    sum.right += tally.right;
    sum.wrong += tally.wrong;
  }

  REQUIRE(polygon_matches > 100);
  REQUIRE(sum.right + sum.wrong < polygon_matches);
}

TEST_CASE("Too few landmarks match nothing", "[hierarchy]") {
  std::mt19937_64 random(36);
  const auto forest = test::random_forest(200, random);
  const GeometricHierarchy map(forest);
  REQUIRE(match(GeometricHierarchy(), map).empty());
  REQUIRE(match(map, GeometricHierarchy()).empty());
  const std::vector<LandmarkPosition> two(forest.begin(), forest.begin() + 2);
  REQUIRE(match(GeometricHierarchy(two), map).empty());
}
