#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/wheel_odometry.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

namespace {

constexpr model::Utime kStep = 25'000;

/// Encoder speed for a wanted speed of the axle.
double encoder_speed(const CarGeometry& car, double speed, double steering) {
  return speed * (1.0 - std::tan(steering) * car.encoder_left_m / car.wheelbase_m);
}

/// Motion over `seconds` at constant speed and steering.
model::Odometry drive(const WheelOdometryParameters& parameters, double speed, double steering,
                      double seconds) {
  WheelOdometry wheels(parameters);
  const model::Utime end = static_cast<model::Utime>(seconds * 1e6);
  for (model::Utime t = 0; t <= end; t += kStep) {
    wheels.add({t, 0, encoder_speed(parameters.car, speed, steering), steering});
  }
  CHECK_FALSE(wheels.advance_to(1'000));
  const auto motion = wheels.advance_to(1'000 + end);
  REQUIRE(motion);
  return *motion;
}

}  // namespace

TEST_CASE("constant speed and steering drive an arc", "[wheel_odometry]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> speeds(-8.0, 8.0);
  std::uniform_real_distribution<double> steerings(-0.5, 0.5);
  std::uniform_real_distribution<double> times(0.2, 10.0);
  for (int i = 0; i < 200; ++i) {
    const double speed = speeds(random);
    const double steering = steerings(random);
    const double seconds = std::floor(times(random) / 0.025) * 0.025;
    const WheelOdometryParameters parameters;
    const geometry::SE2 motion = drive(parameters, speed, steering, seconds).from_T_to;
    const double radius = parameters.car.wheelbase_m / std::tan(steering);
    const double angle = speed * seconds / radius;
    const geometry::SE2 arc(radius * std::sin(angle), radius * (1.0 - std::cos(angle)), angle);
    CHECK((motion.inverse() * arc).Log().norm() < 1e-6);
  }
}

TEST_CASE("the inner wheel is slower", "[wheel_odometry]") {
  const CarGeometry car;
  CHECK(axle_speed(car, 3.0, 0.0) == Approx(3.0));
  CHECK(axle_speed(car, 3.0, 0.3) > 3.0);  // Turning left, the left wheel is the inner one.
  CHECK(axle_speed(car, 3.0, -0.3) < 3.0);
}

TEST_CASE("the vehicle frame may lie anywhere on the car", "[wheel_odometry]") {
  WheelOdometryParameters parameters;
  const geometry::SE2 at_axle = drive(parameters, 4.0, 0.2, 2.0).from_T_to;
  parameters.car.axle_T_vehicle = geometry::SE2(3.78, 0.5, 0.1);
  const geometry::SE2 expected =
      parameters.car.axle_T_vehicle.inverse() * at_axle * parameters.car.axle_T_vehicle;
  const geometry::SE2 motion = drive(parameters, 4.0, 0.2, 2.0).from_T_to;
  CHECK((motion.inverse() * expected).Log().norm() < 1e-9);
}

TEST_CASE("intervals compound to the whole", "[wheel_odometry]") {
  WheelOdometry increments;
  WheelOdometry whole;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> steering(-0.4, 0.4);
  for (model::Utime t = 0; t <= 10'000'000; t += kStep) {
    const model::WheelSample sample{t, 0, 3.0, steering(random)};
    increments.add(sample);
    whole.add(sample);
  }
  increments.advance_to(0);
  whole.advance_to(0);
  geometry::SE2 compounded;
  for (model::Utime t = 213'700; t < 10'000'000; t += 213'700) {
    const auto motion = increments.advance_to(t);
    REQUIRE(motion);
    CHECK(motion->utime - motion->from_utime == 213'700);
    compounded = compounded * motion->from_T_to;
    if (t + 213'700 >= 10'000'000) {
      CHECK((compounded.inverse() * whole.advance_to(t)->from_T_to).Log().norm() < 1e-9);
    }
  }
}

TEST_CASE("samples that are missing are not invented", "[wheel_odometry]") {
  WheelOdometry wheels;
  CHECK_FALSE(wheels.advance_to(0));
  CHECK_FALSE(wheels.advance_to(100'000));  // No sample at all.
  wheels.add({150'000, 0, 1.0, 0.0});
  CHECK_FALSE(wheels.advance_to(200'000));  // Nothing is known of its beginning.
  CHECK(wheels.advance_to(400'000));
  CHECK_FALSE(wheels.advance_to(1'000'000));  // The last sample is too old.
  CHECK(wheels.intervals_without_samples() == 3);
  wheels.add({150'000, 0, 1.0, 0.0});
  CHECK(wheels.samples_out_of_order() == 1);
  CHECK_FALSE(wheels.advance_to(1'000'000));  // A stamp that does not advance.
}

TEST_CASE("covariances hold against errors of calibration", "[wheel_odometry]") {
  // Errors that stay constant for the correlation time, drawn anew afterwards: over that time and
  // longer the compounded covariance must be about right, and never too small for short ones.
  const WheelOdometryParameters parameters;
  const WheelNoise& noise = parameters.noise;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const double speed = 4.0;
  const double steering = 0.15;
  for (const double seconds : {1.0, 5.0, 20.0}) {
    const model::Odometry nominal = drive(parameters, speed, steering, seconds);
    double heading2 = 0.0;
    constexpr int kRuns = 300;
    for (int run = 0; run < kRuns; ++run) {
      double heading = 0.0;
      for (double t = 0.0; t < seconds - 1e-9; t += noise.correlation_time_s) {
        const double lasts = std::min(noise.correlation_time_s, seconds - t);
        const double v = speed * (1.0 + noise.speed_scale_sigma * normal(random));
        const double s = steering * (1.0 + noise.steering_scale_sigma * normal(random)) +
                         noise.steering_sigma_rad * normal(random);
        heading += v * std::tan(s) / parameters.car.wheelbase_m * lasts;
      }
      const double error =
          heading - speed * std::tan(steering) / parameters.car.wheelbase_m * seconds;
      heading2 += error * error / kRuns;
    }
    const double ratio = nominal.covariance(2, 2) / heading2;
    CHECK(ratio > 0.8);
    if (seconds >= noise.correlation_time_s) CHECK(ratio < 1.3);
    CHECK(nominal.covariance.isApprox(nominal.covariance.transpose()));
    CHECK(nominal.covariance.determinant() > 0.0);
  }
}
