// The whole chain on small simulated drives: accuracy, determinism, and what faults do to it.
#include <iostream>

#include "eval/experiments/frontend/frontend.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

sim::SensorDrive small_drive(std::uint64_t seed, bool has_wheels = true) {
  sim::ForestScenarioParameters forest;
  forest.length_m = 60.0;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 1200;
  if (!has_wheels) suite.wheels.reset();
  return {sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed};
}

eval::harness::ChainRun drive_once(std::uint64_t seed) {
  sim::SensorDrive drive = small_drive(seed);
  eval::harness::ChainOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  return drive_chain(drive, options);
}

bool mentions(const eval::experiments::frontend::FrontendRow& row, const std::string& text) {
  return row.setting.find(text) != std::string::npos;
}

}  // namespace

TEST_CASE("raw sensors become a pose, the same every time") {
  const eval::harness::ChainRun run = drive_once(5);
  REQUIRE(run.slam.size() > 400);
  // Limits at twice the measured value: 4.2 mm and 2.0 mm.
  CHECK(eval::harness::trajectory_error(eval::harness::poses_of(run.slam), run.truth).ate_rms_m <
        0.008);
  CHECK(eval::harness::trajectory_error(eval::harness::poses_of(run.ekf), run.truth).ate_rms_m <
        0.004);
  CHECK(wrong_updates(run) == 0);
  CHECK(run.landmarks.size() > 50);  // measured: 57
  // What no landmark has touched, beside RAW_POSE, whose velocity and bias the filter corrects.
  const auto summed = eval::harness::trajectory_error(run.odometry, run.truth);
  const auto reckoned = eval::harness::trajectory_error(run.dead_reckoned, run.truth);
  CAPTURE(summed.ate_rms_m, reckoned.ate_rms_m);
  CHECK(summed.driven_m == Approx(reckoned.driven_m).epsilon(0.02));
  CHECK(summed.ate_rms_m > reckoned.ate_rms_m);
  CHECK(summed.ate_rms_m < 1.0);
  const eval::harness::ChainRun again = drive_once(5);
  REQUIRE(again.slam.size() == run.slam.size());
  for (std::size_t i = 0; i < run.slam.size(); ++i) {
    REQUIRE(again.slam[i].map_T_vehicle().coordinates() ==
            run.slam[i].map_T_vehicle().coordinates());
  }
}

TEST_CASE("without wheels smooth driving does not pass for standing") {
  sim::SensorDrive drive = small_drive(6, false);
  eval::harness::ChainOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  const eval::harness::ChainRun run = drive_chain(drive, options);
  REQUIRE(run.ekf.size() > 400);
  const eval::harness::TrajectoryError ekf =
      eval::harness::trajectory_error(eval::harness::poses_of(run.ekf), run.truth);
  CAPTURE(ekf.ate_rms_m, ekf.largest_m, ekf.driven_m);
  CHECK(ekf.driven_m > 50.0);
  CHECK(ekf.ate_rms_m < 0.003);  // measured: 1.6 mm
  CHECK(run.ekf.back().reset_counter == 0);
}

TEST_CASE("a configuration that is not there is an error, not the defaults") {
  sim::SensorDrive drive = small_drive(5);
  eval::harness::ChainOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/no-such-vehicle";
  REQUIRE_THROWS_AS(drive_chain(drive, options), bus::ConfigurationError);
}

TEST_CASE("faults of the sensors are named, and the pose comes back") {
  eval::experiments::frontend::FrontendOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  options.jobs = 2;
  const std::atomic<bool> stop = false;
  eval::experiments::frontend::FrontendRows rows;
  add_fault_rows(options, stop, rows);
  std::cout << to_table(rows.rows());
  for (const eval::experiments::frontend::FrontendRow& row : rows.rows()) {
    INFO(row.setting << ": " << row.what << " " << row.value);
    CHECK(row.pass().value_or(true));
    if (mentions(row, "silent for")) CHECK(mentions(row, "sensor_silent"));
    if (mentions(row, "1 s back")) CHECK(mentions(row, "clock_jump"));
    if (mentions(row, "NaN")) CHECK(mentions(row, "not_finite"));
    if (mentions(row, "saturated")) CHECK(mentions(row, "/saturated"));
  }
}
