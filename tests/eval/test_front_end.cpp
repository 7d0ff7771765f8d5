// The measures of the associator and of the filter, on short drives.
#include "eval/ekf_consistency.hpp"
#include "eval/tracking.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

sim::TrunkField small_forest() {
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 250.0;
  return sim::make_trunk_field(forest, 3);
}

sim::InertialDriveParameters short_drive() {
  sim::InertialDriveParameters drive;
  drive.standing_s = 1.0;
  drive.loop_length_m = 300.0;
  drive.range_m = 20.0;
  return drive;
}

}  // namespace

TEST_CASE("Tracking is scored against the truth", "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  TrackingOptions options;
  options.drive = short_drive();
  options.duration_s = 20.0;
  const TrackingResult good = run_tracking(options, forest, 1);
  REQUIRE(good.purity > 0.999);
  REQUIRE(good.tracks > 20);
  REQUIRE(good.published_share > 0.8);
  REQUIRE(good.driven_km > 0.05);
  // The same score must tell a bad associator: nothing but the last motion, and no refinement.
  options.drive.odometry = sim::OdometryKind::kNone;
  options.associator.method = "nearest";
  const TrackingResult bad = run_tracking(options, forest, 1);
  REQUIRE(bad.purity < good.purity);
  REQUIRE(bad.switches > good.switches);
}

TEST_CASE("Consistency is scored against the truth", "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  EkfDriveOptions options;
  options.drive = short_drive();
  options.duration_s = 12.0;
  std::vector<EkfDriveResult> runs;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    runs.push_back(run_ekf_drive(options, forest, seed));
    REQUIRE(runs.back().nees.size() == 120);
  }
  const EkfConsistency summary = summarise(runs);
  REQUIRE(summary.runs == 8);
  REQUIRE(summary.band_low < 3.0);
  REQUIRE(summary.band_high > 3.0);
  REQUIRE(summary.overall_nees > 0.5);
  REQUIRE(summary.overall_nees < 6.0);
  REQUIRE(summary.drift_percent < 2.0);
  REQUIRE(summary.restarts == 0);
  // Errors made ten times larger are seen.
  for (EkfDriveResult& run : runs) {
    for (double& nees : run.nees) nees *= 100.0;
  }
  REQUIRE(summarise(runs).share_in_band < 0.2);
}
