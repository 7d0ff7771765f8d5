// A laser with one plane, IMU and wheels through the whole chain.
#include "common/wire/convert.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

/// 60 m on a circle of 10 m; half a turn of the laser takes 50 ms, and `says_times` whether it says
/// so.
harness::ChainRun drive_with_one_plane(bool says_times) {
  sim::ForestScenarioParameters forest;
  forest.length_m = 60.0;
  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.lidar.reset();
  suite.planar_laser.emplace();
  sim::SensorDrive drive(sim::forest_scenario(forest, 21), sim::SpeedParameters{}, suite, 21);
  harness::ChainOptions options;
  options.config_dir = std::string(UNDERSTORY_SOURCE_CONFIG) + "/lidar";
  options.meddle = [says_times](harness::RawMessage message) {
    if (says_times || message.channel != "RAW_SCAN") return std::vector{std::move(message)};
    auto scan = wire::decode_message<model::PlanarScan>(message.bytes);
    REQUIRE(scan);
    scan->beam_interval_s = 0.0;
    return std::vector{harness::RawMessage{message.utime, "RAW_SCAN", wire::encode_message(*scan)}};
  };
  return drive_chain(drive, options);
}

double error_m(const harness::ChainRun& run) {
  return harness::trajectory_error(run.slam, run.truth).ate_rms_m;
}

}  // namespace

TEST_CASE("Scans of one plane make a map, better when they are de-skewed", "[chain]") {
  const harness::ChainRun run = drive_with_one_plane(true);
  const harness::ChainRun skewed = drive_with_one_plane(false);
  CAPTURE(error_m(run), error_m(skewed), run.landmarks.size(), run.slam.size());
  CHECK(run.landmarks.size() > 20);
  CHECK(run.slam.size() > 200);
  CHECK(harness::wrong_updates(run) == 0);
  CHECK(error_m(run) < 0.1);
  CHECK(2.0 * error_m(run) < error_m(skewed));
}
