#include <Eigen/LU>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

/// Of the accelerometer, whose bias passes for an error of the level [m/s^2].
constexpr double kForceBias = 0.05;

struct Rest {
  std::vector<model::RestLevel> published;
  Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();   ///< True, of roll and pitch at its end.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< As stated at its end.
};

Rest rest_of(const test::Drive& drive, const SensorErrors& errors, double length_s,
             std::uint64_t seed) {
  std::mt19937_64 random(seed);
  LidarImuInput input(parameters_for_drive());
  Rest result;
  for (model::Utime t = 1; test::seconds(t) < length_s; t += 10'000) {
    (void)input.add(wheels_at(drive, t, errors, random));
    for (const InputResult& one : input.add(imu_at(drive, t, 100.0, errors, random)))
      if (const auto* level = std::get_if<model::RestLevel>(&one))
        result.published.push_back(*level);
    if (test::seconds(t) > drive.stand_s) continue;

    const RollPitchYaw is = roll_pitch_yaw(input.motion().attitude()->level_Q_vehicle());
    result.error_rad = {is.roll_rad - drive.roll(0.0), is.pitch_rad - drive.pitch(0.0)};
    result.covariance = input.motion().attitude()->tilt_covariance();
  }
  return result;
}

}  // namespace

TEST_CASE("The first metres show by how much the level was off at rest", "[attitude]") {
  std::mt19937_64 random(1);
  test::Drive drive;
  drive.stand_s = 10.0;
  double nees = 0.0;
  double before_rad2 = 0.0;
  double after_rad2 = 0.0;
  constexpr int kRuns = 40;

  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const Rest rest = rest_of(drive, usual_errors(random, kForceBias), 25.0, run);
    REQUIRE(!rest.published.empty());
    const model::RestLevel& last = rest.published.back();
    CHECK(last.rest_from_utime < 1'000'000);
    CHECK(std::abs(test::seconds(last.rest_utime) - drive.stand_s) < 0.5);
    CHECK(last.utime > last.rest_utime);

    const Eigen::Vector2d left = rest.error_rad - last.error_rad;
    nees += left.dot(last.covariance.inverse() * left) / kRuns;
    before_rad2 += rest.error_rad.squaredNorm();
    after_rad2 += left.squaredNorm();
  }
  CAPTURE(nees, std::sqrt(before_rad2 / kRuns), std::sqrt(after_rad2 / kRuns));
  // Two degrees of freedom. The filter's model is coarser than the sensors'.
  CHECK(nees > 1.0);
  CHECK(nees < 4.0);
  CHECK(std::sqrt(after_rad2) < 0.35 * std::sqrt(before_rad2));
}

TEST_CASE("What is published of the level at rest becomes better, and ends", "[attitude]") {
  std::mt19937_64 random(2);
  test::Drive drive;
  drive.stand_s = 10.0;
  const Rest rest = rest_of(drive, usual_errors(random, kForceBias), 60.0, 7);
  REQUIRE(rest.published.size() > 3);
  CHECK(rest.published.size() < 40);
  double last = rest.covariance.trace();
  for (std::size_t i = 0; i < rest.published.size(); ++i) {
    CHECK(rest.published[i].sequence == i);
    CHECK(rest.published[i].covariance.trace() < last);
    last = rest.published[i].covariance.trace();
  }
}

TEST_CASE("A vehicle that was never stationary publishes nothing of a rest", "[attitude]") {
  std::mt19937_64 random(3);
  test::Drive drive;
  drive.stand_s = -20.0;
  CHECK(rest_of(drive, usual_errors(random, kForceBias), 20.0, 1).published.empty());
}
