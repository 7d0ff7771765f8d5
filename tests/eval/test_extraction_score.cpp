// The score of an extractor on a simulated drive.
#include "eval/experiments/frontend/landmark_extraction.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::frontend;

namespace {

sim::SensorDrive short_drive() {
  sim::ForestScenarioParameters forest;
  forest.length_m = 40.0;
  forest.margin_m = 40.0;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 1200;
  sim::SpeedParameters speed;
  speed.standstill_s = 1.0;
  return {sim::forest_scenario(forest, 3), speed, suite, 7};
}

}  // namespace

TEST_CASE("An ideal sweep comes with the attitude and the error that was asked for", "[eval]") {
  sim::SensorDrive drive = short_drive();
  const model::PointSweep sweep = ideal_input(drive.sweep(20), drive, {0.02, -0.05}, 0.003);
  REQUIRE(sweep.attitude);
  const sim::VehicleState state = drive.state_at(sweep.utime);
  const Eigen::Vector3d up = sweep.attitude->level_Q_vehicle.inverse() * Eigen::Vector3d::UnitZ();
  CHECK(std::atan2(up.y(), up.z()) == Approx(state.roll_rad + 0.02));
  CHECK(-std::asin(up.x()) == Approx(state.pitch_rad - 0.05));
  CHECK(sweep.attitude->covariance_rad2.isApprox(9e-6 * Eigen::Matrix2d::Identity()));
}

TEST_CASE("Trunks that are found are right, found and counted once", "[eval]") {
  sim::SensorDrive drive = short_drive();
  ExtractionOptions options;
  options.sweeps = 4;
  const ExtractionScore score = score_extraction(drive, {}, options);
  REQUIRE(score.sweeps == 4);
  const KindScore& trunks = score.trunks;
  CHECK(trunks.should > 20);
  CHECK(trunks.recall() > 0.85);
  CHECK(trunks.precision() > 0.95);
  CHECK(trunks.rms_m < 0.1);
  CHECK(score.misses.size() ==
        trunks.should - trunks.found + trunks.detections - trunks.right + score.corners.detections);
}
