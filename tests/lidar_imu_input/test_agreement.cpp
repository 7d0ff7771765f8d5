// IMU and wheels: which of them is wrong, by whether they measure one motion.
#include <numbers>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "services/lidar_imu_input/motion_agreement.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using Catch::Matchers::Contains;

namespace {

constexpr double kTestDegree_rad = std::numbers::pi / 180.0;
constexpr double kWheelbase_m = 2.7;

/// What is done to the readings.
struct Readings {
  Eigen::Matrix3d rate = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d force = Eigen::Matrix3d::Identity();
  double speed = 1.0;
  double steering = 1.0;
};

test::Drive any_drive(std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0.5, 1.0);
  test::Drive drive;
  drive.stand_s = 4.0;
  drive.top_speed_mps *= share(random);
  drive.turn_rad_s *= share(random) * (random() % 2 == 0 ? 1.0 : -1.0);
  drive.tilt_rad *= share(random);
  return drive;
}

model::WheelSample steered_at(const test::Drive& drive, model::Utime utime,
                              const test::SensorErrors& errors, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  model::WheelSample sample = test::wheels_at(drive, utime, errors, random);
  const double speed = drive.speed(test::seconds(utime));
  const double turn = drive.rate(test::seconds(utime)).z();
  if (speed > 0.1)
    sample.steering_rad = std::atan(kWheelbase_m * turn / speed) + 0.005 * normal(random);
  return sample;
}

/// What is found in the first ten seconds of motion.
MotionAgreement after_drive(const Readings& wrong, std::mt19937_64& random) {
  const test::Drive drive = any_drive(random);
  const test::SensorErrors errors = test::usual_errors(random);
  LidarImuInputParameters parameters = test::parameters_for_drive();
  parameters.wheels.car.wheelbase_m = kWheelbase_m;
  MotionAgreement agreement(parameters);
  for (model::Utime t = 0; test::seconds(t) < drive.stand_s + 10.0; t += 5'000) {
    if (t % 10'000 == 0) {
      model::WheelSample wheels = steered_at(drive, t, errors, random);
      wheels.speed_mps *= wrong.speed;
      wheels.steering_rad *= wrong.steering;
      agreement.add(wheels);
    }
    model::ImuSample imu = test::imu_at(drive, t, 200.0, errors, random);
    imu.angular_rate_rad_s = wrong.rate * imu.angular_rate_rad_s;
    imu.specific_force_mps2 = wrong.force * imu.specific_force_mps2;
    agreement.add(imu);
  }
  return agreement;
}

Eigen::Matrix3d about_z(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

TEST_CASE("Sound IMU and wheels agree, with and without steering", "[agreement]") {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(seed);
    const MotionAgreement agreement = after_drive({.steering = seed % 3 == 0 ? 0.0 : 1.0}, random);
    CHECK(agreement.odd() == OddOne::kNone);
    CHECK(agreement.text().empty());
  }
}

TEST_CASE("An IMU at another yaw is named with the yaw that mends it", "[agreement]") {
  std::uniform_real_distribution<double> yaw(10.0, 180.0);
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const double off_rad = (random() % 2 == 0 ? 1.0 : -1.0) * yaw(random) * kTestDegree_rad;
    const MotionAgreement agreement =
        after_drive({.rate = about_z(-off_rad), .force = about_z(-off_rad)}, random);
    REQUIRE(agreement.odd() == OddOne::kImuYaw);
    CHECK(std::abs(std::remainder(agreement.value() - off_rad, 2.0 * std::numbers::pi)) <
          5.0 * kTestDegree_rad);
    CHECK_THAT(agreement.text(), Contains("imu.mount yaw_rad"));
  }
}

TEST_CASE("Sign and unit of gyro and wheels are told apart", "[agreement]") {
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  const std::pair<Readings, OddOne> faults[] = {
      {{.rate = -one}, OddOne::kGyroSign},    {{.rate = one / kTestDegree_rad}, OddOne::kGyroUnit},
      {{.speed = 3.6}, OddOne::kWheelSpeed},  {{.speed = 0.5}, OddOne::kWheelSpeed},
      {{.speed = -1.0}, OddOne::kWheelSpeed}, {{.steering = -1.0}, OddOne::kSteering}};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const auto& [readings, odd] : faults) {
      std::mt19937_64 random(seed);
      const MotionAgreement agreement = after_drive(readings, random);
      CHECK(agreement.odd() == odd);
      CHECK_FALSE(agreement.text().empty());
      if (odd == OddOne::kWheelSpeed)
        CHECK(agreement.value() == Approx(readings.speed).epsilon(0.1));
    }
  }
}

TEST_CASE("A sensor that is certainly wrong is left out of the motion", "[agreement]") {
  std::mt19937_64 random(5);
  const test::Drive drive = any_drive(random);
  const test::SensorErrors errors = test::usual_errors(random);
  LidarImuInputParameters parameters = test::parameters_for_drive();
  parameters.wheels.car.wheelbase_m = kWheelbase_m;

  // The way by a stage whose gyro is turned round, and by one that is right.
  const auto end_of = [&](double sign) {
    LidarImuInput stage(parameters);
    geometry::SE2 drove;
    std::mt19937_64 noise(9);
    for (model::Utime t = 0; test::seconds(t) < drive.stand_s + 20.0; t += 5'000) {
      InputResults results;
      if (t % 10'000 == 0) results = stage.add(steered_at(drive, t, errors, noise));
      model::ImuSample imu = test::imu_at(drive, t, 200.0, errors, noise);
      imu.angular_rate_rad_s *= sign;
      for (InputResult& result : stage.add(imu)) results.push_back(std::move(result));
      for (const InputResult& result : results) {
        const auto* motion = std::get_if<model::Odometry>(&result);
        if (motion == nullptr || test::seconds(motion->from_utime) < drive.stand_s + 12.0) continue;
        drove = drove * motion->from_T_to;
      }
    }
    CHECK(stage.leaves_out(Sensor::kImu) == (sign < 0.0));
    return drove;
  };
  const geometry::SE2 right = end_of(1.0);
  const geometry::SE2 wrong = end_of(-1.0);
  CHECK((right.translation() - wrong.translation()).norm() < 0.1 * right.translation().norm());
}
