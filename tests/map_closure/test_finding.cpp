// Where two submaps lie to each other, from their landmarks.
#include <fmt/format.h>

#include <Eigen/LU>

#include "tests/catch.hpp"
#include "tests/map_closure/ring_map.hpp"

using namespace understory;
using namespace understory::map_closure;
using Catch::Matchers::Contains;
using test::RingMap;

TEST_CASE("A place that is in the map twice is found, with its covariance", "[map_closure]") {
  double nees = 0.0;
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    RingMap ring({.seed = seed});
    const PartGraph graph = ring.graph();
    const std::size_t last = ring.size() - 1;
    const FoundClosure one = find_closure(ring.map, graph, 3, last);
    CAPTURE(one.alignment.reason({}));
    if (!one.alignment.found()) continue;
    ++found;
    const Eigen::Vector3d off =
        (one.from_T_to.mean.inverse() * (ring.truth(3).inverse() * ring.truth(last))).Log();
    CHECK(off.head<2>().norm() < 0.3);
    nees += off.dot(one.from_T_to.covariance.inverse() * off);

    // The other way round it is the same place.
    const FoundClosure back = find_closure(ring.map, graph, last, 3);
    REQUIRE(back.alignment.found());
    CHECK((one.from_T_to.mean * back.from_T_to.mean).Log().norm() < 0.1);
  }
  WARN(fmt::format("{} of 20 found, mean NEES {:.2f} (3 is exact)", found,
                   nees / static_cast<double>(found)));
  CHECK(found >= 18);
  CHECK(nees / static_cast<double>(found) < 6.0);
}

TEST_CASE("Places with nothing in common are not found", "[map_closure]") {
  std::size_t tried = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const RingMap ring({.seed = seed});
    const PartGraph graph = ring.graph();
    for (const auto& [from, to] : {std::pair<std::size_t, std::size_t>{6, 20}, {10, 28}}) {
      CHECK_FALSE(find_closure(ring.map, graph, from, to).alignment.found());
      ++tried;
    }
  }
  CHECK(tried == 20);
}

TEST_CASE("Neighbours on the path have no loop between them", "[map_closure]") {
  const RingMap ring({.seed = 2});
  const PartGraph graph = ring.graph();
  CHECK_THROWS_WITH(find_closure(ring.map, graph, 5, 6), Contains("neighbours"));
  CHECK_THROWS_WITH(find_closure(ring.map, graph, 6, 4), Contains("neighbours"));
}

TEST_CASE("After a closure trees that are in the map twice coincide", "[map_closure]") {
  RingMap ring({.seed = 12, .motion_sigma_rad = 0.02});
  const PartGraph graph = ring.graph();
  const std::size_t last = ring.size() - 1;
  const FoundClosure found = find_closure(ring.map, graph, 3, last);
  REQUIRE(found.alignment.found());
  const ClosedGraph made = closed(graph, {3, last, found.from_T_to});
  Shifts shifts;
  const map_file::StoredMap after = moved(ring.map, graph, made, shifts);
  const std::size_t before_pairs = coincident_pairs(ring.map, graph, 0.3);
  const std::size_t pairs = coincident_pairs(after, graph, 0.3);
  CAPTURE(before_pairs);
  CHECK(pairs > before_pairs + 10);
  CHECK(pairs >= found.alignment.pairs.size() / 2);
}
