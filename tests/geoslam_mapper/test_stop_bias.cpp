// What stops show of the gyro's bias.
#include <cmath>
#include <random>

#include "common/model/archive.hpp"
#include "services/geoslam_mapper/smoothing/stop_bias.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kIncrement_s = 0.1;
constexpr double kGyroNoise = 2e-4;  // rad/s/sqrt(Hz)

/// An increment of a gyro that shows `rate` in all, of which odometry takes `known` out.
model::Odometry increment(double rate, double known, bool is_stationary) {
  model::Odometry one;
  one.is_stationary = is_stationary;
  one.inertial.emplace();
  one.inertial->seconds = kIncrement_s;
  one.inertial->yaw_rad = (rate - known) * kIncrement_s;
  one.inertial->bias.x() = known;
  one.inertial->covariance(0, 0) = kGyroNoise * kGyroNoise * kIncrement_s;
  return one;
}

}  // namespace

TEST_CASE("Stops show the gyro's bias as well as they say", "[mapper]") {
  std::mt19937_64 random(41);
  std::normal_distribution<double> normal;
  double sum = 0.0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double bias = 1e-3 * normal(random);
    StopBias stops;
    for (int stop = 0; stop < 2; ++stop) {
      // The body sways between the two ends of a stop; odometry learns on the way.
      const double sway_rad = 5e-4 * (normal(random) - normal(random));
      const int count = 10 + static_cast<int>(random() % 200);
      for (int k = 0; k < count; ++k) {
        const double noise = kGyroNoise / std::sqrt(kIncrement_s) * normal(random);
        const double sway = sway_rad / (count * kIncrement_s);
        stops.add(increment(bias + noise + sway, 1e-3 * normal(random), true));
      }
      for (int k = 0; k < 30; ++k) stops.add(increment(0.3, 0.0, false));
    }
    const auto measured = stops.measured();
    REQUIRE(measured);
    const double error = measured->bias - bias;
    sum += error * error / measured->variance;
  }
  INFO("mean NEES " << sum / kTrials);
  CHECK(sum / kTrials > 0.8);
  CHECK(sum / kTrials < 1.2);
}

TEST_CASE("Without a stop of a second nothing is known of the bias", "[mapper]") {
  StopBias stops;
  for (int k = 0; k < 50; ++k) stops.add(increment(0.2, 0.0, false));
  CHECK_FALSE(stops.measured());
  for (int k = 0; k < 9; ++k) stops.add(increment(1e-3, 0.0, true));
  CHECK_FALSE(stops.measured());
  stops.add(increment(1e-3, 0.0, true));
  stops.add(increment(1e-3, 0.0, true));
  REQUIRE(stops.measured());
  CHECK(stops.measured()->bias == Approx(1e-3));

  SECTION("saved and loaded") {
    StopBias other;
    state::load(state::save({"stops", 1}, stops), {"stops", 1}, other);
    for (StopBias* one : {&stops, &other}) one->add(increment(3e-3, 0.0, true));
    CHECK(stops.measured()->bias == other.measured()->bias);
    CHECK(stops.measured()->variance == other.measured()->variance);
  }
  SECTION("cleared") {
    stops.clear();
    CHECK_FALSE(stops.measured());
  }
  SECTION("an increment without an IMU is no stop") {
    model::Odometry blind = increment(0.0, 0.0, true);
    blind.inertial.reset();
    const double before = stops.measured()->bias;
    for (int k = 0; k < 100; ++k) stops.add(blind);
    CHECK(stops.measured()->bias == before);
  }
}
