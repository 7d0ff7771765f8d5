// One scan finds its place in a map of a square kilometre without any prior.
#include <cmath>
#include <random>

#include "common/constellation/map.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

struct Tally {
  int scans = 0;
  int found = 0;
  double largest_error_m = 0.0;  ///< Of the accepted poses.
};

/// Every eighth scan of circles through the forest, each localised in the map of all its trunks.
Tally localise_single_scans(const sim::Forest& forest, int circles) {
  constellation::ConstellationMap map;
  for (std::size_t i = 0; i < forest.trunks_m.size(); ++i) map.insert(i + 1, forest.trunks_m[i]);

  Tally tally;
  for (int circle = 0; circle < circles; ++circle) {
    const sim::Drive drive(sim::DriveParameters{}, forest, 100 + static_cast<unsigned>(circle));
    for (std::size_t k = 0; k < drive.size(); k += 8) {
      std::vector<constellation::ObservedPoint> points;
      for (const model::Detection& detection : drive.scan(k).scan.detections) {
        points.push_back({detection.position_m.head<2>(),
                          std::sqrt(0.5 * detection.covariance_m2.topLeftCorner<2, 2>().trace())});
      }
      const constellation::Localisation found = map.localise(points);
      ++tally.scans;
      if (!found.found()) continue;
      ++tally.found;
      const double error_m =
          (found.map_T_sensor.translation() - drive.world_T_vehicle()[k].translation()).norm();
      tally.largest_error_m = std::max(tally.largest_error_m, error_m);
    }
  }
  return tally;
}

}  // namespace

TEST_CASE("every single scan is localised in a large map, none wrongly", "[claims]") {
  std::mt19937_64 random(1);
  const sim::Forest forest =
      sim::make_forest(sim::forest_parameters(sim::ForestKind::kIntermediate), random);
  REQUIRE(forest.trunks_m.size() > 13'000);

  const Tally tally = localise_single_scans(forest, 4);

  CAPTURE(tally.scans, tally.found, tally.largest_error_m);
  CHECK(tally.scans == 500);
  CHECK(tally.found == tally.scans);
  CHECK(tally.largest_error_m < 0.2);
}
