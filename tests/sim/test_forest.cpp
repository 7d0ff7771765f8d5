#include <cmath>
#include <numeric>

#include "sim/forest.hpp"
#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;

namespace {

double mean_nearest_distance(const sim::Forest& forest) {
  const sim::PointGrid grid(forest.trunks_m, 10.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < forest.trunks_m.size(); ++i) {
    double radius = 2.0;
    double best = INFINITY;
    for (; !std::isfinite(best); radius *= 2.0) {
      for (const std::uint32_t j : grid.within(forest.trunks_m[i], radius)) {
        if (j != i) best = std::min(best, (forest.trunks_m[i] - forest.trunks_m[j]).norm());
      }
    }
    sum += best;
  }

  return sum / static_cast<double>(forest.trunks_m.size());
}

sim::Forest forest_of(sim::ForestParameters parameters, std::uint64_t seed) {
  auto random = random_stream(seed, sim::Stream::kForest);
  return make_forest(parameters, random);
}

}  // namespace

TEST_CASE("The forests have as many trunks as the published ones, as far apart", "[forest]") {
  struct Expected {
    sim::ForestKind kind;
    double trunks;
    double nearest_m;
  };

  const Expected row = GENERATE(Expected{sim::ForestKind::kDense, 42011, 2.733},
                                Expected{sim::ForestKind::kIntermediate, 13770, 4.968},
                                Expected{sim::ForestKind::kSparse, 8419, 6.560});
  const sim::Forest forest = forest_of(forest_parameters(row.kind), 1);
  INFO(to_string(row.kind) << " " << forest.trunks_m.size() << " trunks, nearest "
                           << mean_nearest_distance(forest));
  CHECK(static_cast<double>(forest.trunks_m.size()) == Approx(row.trunks).epsilon(0.015));
  CHECK(mean_nearest_distance(forest) == Approx(row.nearest_m).epsilon(0.03));
}

TEST_CASE("The correct Poisson-disc algorithm keeps its distance and gives fewer trunks",
          "[forest]") {
  sim::ForestParameters parameters = forest_parameters(sim::ForestKind::kIntermediate);
  parameters.jitter_sigma_m = 0.0;
  parameters.tile_reach = 2;
  const sim::Forest forest = forest_of(parameters, 1);
  CHECK(static_cast<double>(forest.trunks_m.size()) == Approx(12800).epsilon(0.02));
  const sim::PointGrid grid(forest.trunks_m, 10.0);
  for (const Eigen::Vector2d& trunk : forest.trunks_m) {
    REQUIRE(grid.within(trunk, 0.999999 * parameters.min_distance_m).size() == 1);
  }
}

TEST_CASE("A forest follows from its seed alone", "[forest]") {
  const sim::ForestParameters parameters = forest_parameters(sim::ForestKind::kSparse);
  CHECK(forest_of(parameters, 5).trunks_m == forest_of(parameters, 5).trunks_m);
  CHECK(forest_of(parameters, 5).trunks_m != forest_of(parameters, 6).trunks_m);
}

TEST_CASE("The grid finds what brute force finds", "[grid]") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(-50.0, 50.0);
  std::uniform_real_distribution<double> beyond(-150.0, 150.0);
  std::vector<Eigen::Vector2d> points(300);
  for (auto& p : points) p = {anywhere(random), anywhere(random)};
  const sim::PointGrid grid(points, 7.0);

  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d centre(beyond(random), beyond(random));
    const double radius = std::abs(beyond(random)) / 5.0;
    std::vector<std::uint32_t> expected;
    std::uint32_t nearest = 0;
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      if ((points[k] - centre).norm() <= radius) expected.push_back(k);
      if ((points[k] - centre).norm() < (points[nearest] - centre).norm()) nearest = k;
    }
    REQUIRE(grid.within(centre, radius) == expected);
    REQUIRE(grid.any_within(centre, radius) == !expected.empty());
    REQUIRE(grid.nearest(centre)->index == nearest);
  }

  CHECK_FALSE(sim::PointGrid({}, 7.0).nearest({0, 0}));
  CHECK(sim::PointGrid({}, 7.0).within({0, 0}, 5.0).empty());
}

TEST_CASE("Stem maps: columns by name, faults with their line", "[stem_map]") {
  const auto good =
      sim::parse_stem_map("tag,y_m,x_m,dbh_m\n# note\n1,2.0,1.0,0.4\r\n\n2,-4.5,3.25,\n");
  REQUIRE(good.error.empty());
  REQUIRE(good.forest.trunks_m.size() == 2);
  CHECK(good.forest.trunks_m[0] == Eigen::Vector2d(1.0, 2.0));
  CHECK(good.forest.radii_m[0] == Approx(0.2));
  CHECK(good.forest.radii_m[1] == 0.0);
  CHECK(good.forest.low_m == Eigen::Vector2d(1.0, -4.5));

  CHECK(sim::parse_stem_map("x_m,y_m\n1,2\n1,two\n").error.find("line 3") != std::string::npos);
  CHECK(sim::parse_stem_map("x_m,y_m\n1,nan\n").error.find("line 2") != std::string::npos);
  CHECK(sim::parse_stem_map("x_m,y_m,dbh_m\n1,2,-0.1\n").error.find("negative") !=
        std::string::npos);
  CHECK(sim::parse_stem_map("x_m,y_m\n1e300,2\n").error ==
        "line 2: x_m is farther than 1e8 m from the origin");
  CHECK(sim::parse_stem_map("x_m,y_m\n1,2\n3,-1e7\n").error ==
        "line 3: y_m is farther than 200 km from the first row's");
  CHECK(sim::parse_stem_map("x_m,y_m,dbh_m\n1,2,1e300\n").error ==
        "line 2: dbh_m is thicker than 20 m");
  CHECK(sim::parse_stem_map("x_m,y_m\n500000,5400000\n500100,5400100\n").error.empty());
  CHECK_FALSE(sim::parse_stem_map("a,b\n1,2\n").error.empty());
  CHECK_FALSE(sim::parse_stem_map("").error.empty());
}
