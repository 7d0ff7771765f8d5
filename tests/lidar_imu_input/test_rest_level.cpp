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

/// A difference of two errors of the level, and its covariance as stated.
struct LevelChange {
  Eigen::Vector2d change_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

struct Rest {
  std::vector<model::RestLevel> published;
  std::vector<LevelChange> changes;                      ///< One for each published one.
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
    bool has_news = false;
    for (const InputResult& one : input.add(imu_at(drive, t, 100.0, errors, random))) {
      const auto* level = std::get_if<model::RestLevel>(&one);
      if (level == nullptr) continue;
      result.published.push_back(*level);
      has_news = true;
    }

    const AttitudeFilter& attitude = *input.motion().attitude();
    const RollPitchYaw is = roll_pitch_yaw(attitude.level_Q_vehicle());
    const double s = test::seconds(t);
    const Eigen::Vector2d error_rad(is.roll_rad - drive.roll(s), is.pitch_rad - drive.pitch(s));
    if (s <= drive.stand_s) {
      result.error_rad = error_rad;
      result.covariance = attitude.tilt_covariance();
    }
    if (!has_news) continue;

    const Eigen::Rotation2Dd rest_R_now(drive.heading(s) - drive.heading(0.0));
    result.changes.push_back({result.error_rad - attitude.rest().error_rad - rest_R_now * error_rad,
                              attitude.tilt_change_covariance()});
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

TEST_CASE("By how much the level has changed since the rest is stated right", "[attitude]") {
  std::mt19937_64 random(4);
  test::Drive drive;
  drive.stand_s = 10.0;
  double nees_early = 0.0, nees_late = 0.0;
  double early_rad2 = 0.0, error_rad2 = 0.0;
  constexpr int kRuns = 40;

  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const Rest rest = rest_of(drive, usual_errors(random, kForceBias), 40.0, run);
    const auto at_s = [&](double s) {
      const auto after = std::ranges::find_if(rest.published, [&](const model::RestLevel& one) {
        return test::seconds(one.utime) > s;
      });
      REQUIRE(after != rest.published.end());
      return rest.changes[static_cast<std::size_t>(after - rest.published.begin())];
    };
    const LevelChange early = at_s(drive.stand_s + 2.0);
    const LevelChange late = at_s(drive.stand_s + 8.0);
    nees_early += early.change_rad.dot(early.covariance.inverse() * early.change_rad) / kRuns;
    nees_late += late.change_rad.dot(late.covariance.inverse() * late.change_rad) / kRuns;
    early_rad2 += early.change_rad.squaredNorm();
    error_rad2 += rest.error_rad.squaredNorm();
  }
  CAPTURE(nees_early, nees_late, early_rad2, error_rad2);
  // Two degrees of freedom. The error itself is far larger, and the same then and now.
  CHECK(nees_early > 0.7);
  CHECK(nees_early < 4.0);
  CHECK(nees_late > 0.7);
  CHECK(nees_late < 4.0);
  CHECK(std::sqrt(early_rad2) < 0.3 * std::sqrt(error_rad2));
}

TEST_CASE("What is published of the level at rest becomes better, and ends", "[attitude]") {
  std::mt19937_64 random(2);
  test::Drive drive;
  drive.stand_s = 10.0;
  const Rest rest = rest_of(drive, usual_errors(random, kForceBias), 60.0, 7);
  double last = rest.covariance.trace();
  int rest_messages = 0, messages = 0;
  for (std::size_t i = 0; i < rest.published.size(); ++i) {
    const model::RestLevel& level = rest.published[i];
    CHECK(level.sequence == i);
    CHECK(level.rest_utime <= level.utime);

    // At rest next to nothing is found. Then and now are the same but for some tenths of a second:
    // when motion is noticed, the rest is that of before.
    if (level.rest_utime == level.utime) {
      CHECK(level.error_rad.norm() < 2e-4);
      CHECK(level.change_covariance.norm() < 1e-7);
      ++rest_messages;
      continue;
    }
    CHECK(level.covariance.trace() < 1.001 * last);
    last = level.covariance.trace();
    ++messages;
  }
  CHECK(rest_messages >= 7);
  CHECK(rest_messages <= 12);
  CHECK(messages > 3);
  CHECK(messages < 60);
  CHECK(last < 0.1 * rest.covariance.trace());
}

TEST_CASE("A vehicle that was never stationary publishes nothing of a rest", "[attitude]") {
  std::mt19937_64 random(3);
  test::Drive drive;
  drive.stand_s = -20.0;
  CHECK(rest_of(drive, usual_errors(random, kForceBias), 20.0, 1).published.empty());
}
