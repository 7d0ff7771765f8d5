// The chain beside the batch solution of its own measurements with true association.
#include "eval/experiments/frontend/chain_limit.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;
using namespace understory::eval::experiments::frontend;

TEST_CASE("The chain stays near the limit of its measurements", "[limit]") {
  sim::ForestScenarioParameters forest;
  forest.length_m = 60.0;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 900;
  sim::SensorDrive drive(sim::forest_scenario(forest, 21), sim::SpeedParameters{}, suite, 21);
  harness::ChainOptions options;
  options.config_dir = std::string(UNDERSTORY_SOURCE_CONFIG) + "/lidar";
  options.keep_measurements = true;
  const harness::ChainRun run = drive_chain(drive, options);

  const LimitScore score = score_against_limit(run, drive.world(), 10);
  CAPTURE(score.map_rms_m, score.batch_rms_m, score.pose_rms_m, score.causal_rms_m,
          score.trunk_noise, score.keyframes, score.times);
  CHECK(score.keyframes > 5);
  CHECK(score.times > 8);
  CHECK(score.batch_rms_m > 0.0);
  CHECK(score.batch_rms_m < 0.02);
  CHECK(score.causal_rms_m < 0.02);
  CHECK(score.map_rms_m < 3.0 * score.batch_rms_m);
  CHECK(score.pose_rms_m < 3.0 * score.causal_rms_m);

  // More data do not make it worse: the last causal pose is that of the whole.
  const ChainLimit limit(run, drive.world());
  const metrics::StampedPose last = limit.causal(limit.size() - 1);
  CHECK((last.pose.translation() - limit.poses().back().pose.translation()).norm() < 1e-6);
}
