// Gaps through the whole chain: one drive each, where something was wrong once.
#include "eval/experiments/gaps/gap_drive.hpp"
#include "tests/catch.hpp"

using namespace understory::eval::experiments::gaps;

namespace {

/// Of three standard deviations with three degrees of freedom.
constexpr double kThreeSigma = 14.16;

GapDrive here() {
  GapDrive drive;
  drive.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  return drive;
}

}  // namespace

TEST_CASE("A keyframe that a long pause cuts in two is not 160 m off", "[gap]") {
  const GapScore score = drive(here(), {"LIDAR", "", "RAW_SWEEP", 30.0}, 701);
  CHECK(score.ekf.goes_on);
  REQUIRE(score.slam.goes_on);
  REQUIRE(score.slam.nees);
  CHECK(*score.slam.nees < kThreeSigma);
  CHECK(score.slam.step_m < 3.0);
  CHECK_FALSE(score.slam.is_new_map);
}

TEST_CASE("A mapper that hangs for a second goes on where it was", "[gap]") {
  const GapScore score = drive(here(), {"mapper", "geoslam_mapper", "", 1.1}, 701);
  CHECK(score.ekf.step_m < 0.05);
  REQUIRE(score.slam.goes_on);
  REQUIRE(score.slam.nees);
  CHECK(*score.slam.nees < kThreeSigma);
  CHECK(score.slam.step_m < 0.1);
  CHECK(score.slam.rms_m < 0.03);
}

TEST_CASE("Poses among sweeps that no IMU has levelled state what these have in common", "[gap]") {
  for (const std::uint64_t seed : {702, 703}) {
    const GapScore score = drive(here(), {"IMU", "", "RAW_IMU", 6.0}, seed);
    for (const PosesAroundGap& poses : {score.slam, score.ekf}) {
      REQUIRE(poses.goes_on);
      REQUIRE(poses.nees);
      CAPTURE(seed, *poses.nees);
      CHECK(*poses.nees < kThreeSigma);
      CHECK(*poses.nees > 0.05);
      CHECK_FALSE(poses.is_new_map);
    }
  }
}
