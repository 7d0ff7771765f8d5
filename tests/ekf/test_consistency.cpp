// The filter's covariance is that of its errors, with any kind of odometry.
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

struct Mean {
  double nees = 0.0;
  double last_nees = 0.0;
  double drift = 0.0;
};

Mean over_runs(const sim::InertialDriveParameters& drive, const EkfParameters& filter, int runs,
               double seconds) {
  Mean mean;
  for (int run = 0; run < runs; ++run) {
    const test::DriveEnd end =
        test::drive_through(drive, filter, seconds, 100 + static_cast<unsigned>(run));
    mean.nees += end.mean_nees / runs;
    mean.last_nees += end.last_nees / runs;
    mean.drift += end.drift / runs;
  }
  return mean;
}

}  // namespace

TEST_CASE("NEES and drift with an IMU, with wheels, with both", "[ekf][consistency]") {
  for (const auto odometry : {sim::OdometryKind::kInertial, sim::OdometryKind::kWheels,
                              sim::OdometryKind::kInertialAndWheels}) {
    sim::InertialDriveParameters drive = test::short_drive();
    drive.odometry = odometry;
    const Mean mean = over_runs(drive, test::white_noise(), 20, 25.0);
    CAPTURE(static_cast<int>(odometry), mean.nees, mean.drift);
    // 95 % band of a 20-run mean: 2.0 .. 4.2 if scans were one; the mean over a drive lies closer.
    REQUIRE(mean.nees > 1.9);
    REQUIRE(mean.nees < 4.2);
    REQUIRE(mean.drift < 0.002);
  }
}

TEST_CASE("Right invariant errors stay consistent where plain ones do not", "[ekf][consistency]") {
  sim::InertialDriveParameters drive = test::short_drive();
  drive.odometry = sim::OdometryKind::kNone;
  drive.stationary_s = 0.0;
  drive.position_sigma_m = 0.5;
  drive.range_m = 15.0;
  drive.loop_length_m = 100.0;
  EkfParameters filter = test::white_noise();
  const Mean invariant = over_runs(drive, filter, 10, 100.0);
  filter.error_form = "first_estimate";
  const Mean first = over_runs(drive, filter, 10, 100.0);
  filter.error_form = "plain";
  const Mean plain = over_runs(drive, filter, 10, 100.0);
  CAPTURE(invariant.last_nees, first.last_nees, plain.last_nees);
  REQUIRE(invariant.last_nees > 1.6);
  REQUIRE(invariant.last_nees < 4.8);
  REQUIRE(first.last_nees < 5.0);
  REQUIRE(plain.last_nees > 1.5 * invariant.last_nees);
  REQUIRE(plain.last_nees > 6.0);
}
