#include <cmath>
#include <random>

#include "sim/point_grid.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using namespace understory::sim;

namespace {

std::vector<Eigen::Vector2d> trunk_places(const World& world) {
  std::vector<Eigen::Vector2d> places;
  for (const TrueTrunk& trunk : world.trunks()) places.emplace_back(trunk.centre_m.head<2>());
  return places;
}

/// Nothing solid is on the path; walkers may come near.
void check_path_is_clear(const Scenario& scenario, double clearance_m) {
  const PointGrid path(scenario.route.places(0.5), 10.0);
  for (const TrueTrunk& trunk : scenario.world->trunks()) {
    CHECK_FALSE(path.any_within(trunk.centre_m.head<2>(), clearance_m));
  }
  for (const TrueCorner& corner : scenario.world->corners()) {
    CHECK_FALSE(path.any_within(corner.position_m, clearance_m));
  }
  for (ObjectId i = 0; i < scenario.world->object_count(); ++i) {
    if (scenario.world->kind(i) != ObjectClass::kCar) continue;
    CHECK_FALSE(path.any_within(scenario.world->bounds(i).centre_m, 2.0));
  }
}

double least_radius_m(const Route& route) {
  double greatest = 0.0;
  for (double s = 0.0; s < route.length_m(); s += 0.5) {
    greatest = std::max(greatest, std::abs(route.at(s).curvature));
  }
  return 1.0 / greatest;
}

}  // namespace

TEST_CASE("A forest in three dimensions has the density of its kind and a clear path",
          "[scenario]") {
  ForestScenarioParameters parameters;
  parameters.forest = forest_parameters(ForestKind::kIntermediate);
  parameters.length_m = 400.0;
  const Scenario scenario = forest_scenario(parameters, 1);
  check_path_is_clear(scenario, parameters.world.clearance_m);
  CHECK(scenario.route.length_m() == Approx(400.0).epsilon(0.01));
  const double side_m = 400.0 / 3.14159 + 2.0 * parameters.margin_m;

  const double per_m2 = static_cast<double>(scenario.world->trunks().size()) / (side_m * side_m);
  CHECK(per_m2 == Approx(0.0138).epsilon(0.1));
  for (const TrueTrunk& trunk : scenario.world->trunks()) {
    CHECK(trunk.radius_m >= 0.05);
    CHECK(trunk.radius_m <= 0.5);
    const double ground_m = scenario.world->ground().height(trunk.centre_m.head<2>());
    CHECK(trunk.centre_m.z() == Approx(ground_m + 1.3));
  }
}

TEST_CASE("Around the block is about 700 m, closed, with houses on both sides", "[scenario]") {
  const Scenario scenario = urban_scenario(1, 1, 60.0);
  CHECK(scenario.route.length_m() - 60.0 == Approx(700.0).margin(25.0));
  CHECK(least_radius_m(scenario.route) > 4.5);

  // The overlap drives the same street again.
  const double lap_m = scenario.route.length_m() - 60.0;
  const auto again = scenario.route.at(lap_m + 45.0);
  double nearest = 1e9;

  for (double s = 20.0; s < 80.0; s += 0.1) {
    nearest = std::min(nearest, (scenario.route.at(s).position_m - again.position_m).norm());
  }

  CHECK(nearest < 0.015);
  CHECK(scenario.world->corners().size() > 120);
  CHECK(scenario.world->trunks().size() > 50);
  check_path_is_clear(scenario, 2.0);
}

TEST_CASE("Country roads are as long as asked for and do not meet themselves", "[scenario]") {
  const bool from_town = GENERATE(true, false);
  const Scenario scenario =
      from_town ? urban_to_countryside_scenario(3000.0, 4) : countryside_scenario(3000.0, 4);
  CHECK(scenario.route.length_m() == Approx(3000.0).epsilon(0.02));
  CHECK(least_radius_m(scenario.route) > 4.5);
  check_path_is_clear(scenario, 2.0);
  const std::vector<Eigen::Vector2d> places = scenario.route.places(10.0);

  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t k = i + 20; k < places.size(); ++k) {
      REQUIRE((places[i] - places[k]).norm() > 20.0);
    }
  }

  // Some of the path has landmarks, some has none.
  const PointGrid trunks(trunk_places(*scenario.world), 10.0);
  int rich = 0;
  int poor = 0;

  for (const Eigen::Vector2d& place : places) {
    const std::size_t near = trunks.within(place, 20.0).size();
    rich += near >= 6 ? 1 : 0;
    poor += near <= 2 ? 1 : 0;
  }

  CHECK(rich > 20);
  CHECK(poor > 10);
}

TEST_CASE("Every kind of country is on a long road", "[scenario]") {
  // By trunks within 40 m: 25 and more in a wood, at most 24 elsewhere, next to none in fields.
  std::size_t wooded = 0;
  std::size_t bare = 0;
  std::size_t all = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const Scenario scenario = countryside_scenario(4000.0, seed);
    const PointGrid trunks(trunk_places(*scenario.world), 10.0);
    for (const Eigen::Vector2d& place : scenario.route.places(10.0)) {
      const std::size_t near = trunks.within(place, 40.0).size();
      wooded += near >= 25 ? 1 : 0;
      bare += near <= 6 ? 1 : 0;
      ++all;
    }
  }

  // By chance and mean length of their stretches: 37 % wood, 21 % field.
  const auto share = [&](std::size_t part) {
    return static_cast<double>(part) / static_cast<double>(all);
  };
  CHECK(share(wooded) == Approx(0.37).margin(0.15));
  CHECK(share(bare) == Approx(0.21).margin(0.12));
}

TEST_CASE("A map of poles with a trajectory becomes a world", "[scenario]") {
  std::string trajectory = "frame,x_m,y_m,yaw_rad\n";
  for (int i = 0; i < 400; ++i) {
    trajectory += std::to_string(i) + "," + std::to_string(0.5 * i) + "," +
                  std::to_string(10.0 * std::sin(0.02 * i)) + ",0\n";
  }
  const auto result = pole_map_scenario("x_m,y_m\n50,20\n60,-15\n100,12\n0.5,0.1\n", trajectory, 1);
  REQUIRE(result.error.empty());
  REQUIRE(result.scenario.has_value());
  CHECK(result.scenario->world->trunks().size() == 3);  // one was on the path
  CHECK(result.scenario->route.length_m() > 199.0);
  check_path_is_clear(*result.scenario, 1.4);

  CHECK(pole_map_scenario("x,y\n1,2\n", trajectory, 1).error.find("poles: line 1") == 0);
  CHECK(pole_map_scenario("x_m,y_m\n1,2\n", "x_m,y_m\n1,a\n", 1).error.find("trajectory: line 2") ==
        0);
  CHECK_FALSE(pole_map_scenario("x_m,y_m\n1,2\n", "x_m,y_m\n1,1\n1,1\n", 1).error.empty());
  CHECK(pole_map_scenario("x_m,y_m\n1,2\n", trajectory + "9,1e300,1,0\n", 1)
            .error.ends_with("x_m is farther than 1e8 m from the origin"));
  std::string to_and_fro = "x_m,y_m\n";
  for (int i = 0; i < 12; ++i) to_and_fro += i % 2 == 0 ? "0,0\n" : "150000,0\n";
  CHECK(pole_map_scenario("x_m,y_m\n1,2\n", to_and_fro, 1).error ==
        "trajectory: longer than 1000 km");
}

TEST_CASE("Scenarios follow from their seed", "[scenario]") {
  const Scenario a = urban_scenario(1, 5);
  const Scenario b = urban_scenario(1, 5);
  const Scenario c = urban_scenario(1, 6);
  CHECK(trunk_places(*a.world) == trunk_places(*b.world));
  CHECK(trunk_places(*a.world) != trunk_places(*c.world));
  CHECK(a.world->object_count() == b.world->object_count());
}
