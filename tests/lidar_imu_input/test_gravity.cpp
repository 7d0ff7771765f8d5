// An IMU at rest: unit, sign and mounting by what it measures of gravity.
#include <numbers>
#include <random>

#include "services/lidar_imu_input/gravity_check.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using Catch::Matchers::Contains;

namespace {

/// What is done to an IMU that stands on a slope of up to 15 degrees.
struct Wrong {
  Eigen::Matrix3d force_of = Eigen::Matrix3d::Identity();  ///< Applied to the force.
  double gravity_mps2 = 9.81;
};

/// The check after 2 s at rest, with a mounting, a slope, noise and biases drawn at random.
GravityCheck after_rest(const Wrong& wrong, std::mt19937_64& random) {
  std::uniform_real_distribution<double> any(-std::numbers::pi, std::numbers::pi);
  std::uniform_real_distribution<double> slope(-0.18, 0.18);
  std::normal_distribution<double> normal;
  const SensorMount mount{0.0, 0.0, 0.0, any(random), 0.5 * any(random), any(random)};
  const Eigen::Quaterniond level_Q_vehicle =
      Eigen::AngleAxisd(slope(random), Eigen::Vector3d::UnitX()) *
      Eigen::AngleAxisd(slope(random), Eigen::Vector3d::UnitY());
  const Eigen::Vector3d upwards = wrong.force_of * (level_Q_vehicle.conjugate() *
                                                    Eigen::Vector3d(0.0, 0.0, wrong.gravity_mps2));

  GravityCheck check(mount, StandstillParameters{});
  for (model::Utime utime = 0; utime < 2'000'000; utime += 5'000) {
    model::ImuSample sample;
    sample.utime = utime;
    sample.specific_force_mps2 = mount.rotation().conjugate() * upwards;
    for (int axis = 0; axis < 3; ++axis) {
      sample.specific_force_mps2(axis) += 0.002 * wrong.gravity_mps2 * normal(random);
      sample.angular_rate_rad_s(axis) = 0.005 + 0.002 * normal(random);
    }
    check.add(sample);
  }
  return check;
}

test::SensorErrors noise() {
  test::SensorErrors errors;
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  return errors;
}

Eigen::Matrix3d turned(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

}  // namespace

TEST_CASE("At rest gravity shows a wrong unit, a wrong sign and a wrong mounting", "[gravity]") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(0.0, 2.0 * std::numbers::pi);
  for (int trial = 0; trial < 200; ++trial) {
    const double heading = any(random);
    const Eigen::Vector3d level_axis(std::cos(heading), std::sin(heading), 0.0);
    const GravityCheck right = after_rest({}, random);
    CHECK(right.verdict() == GravityVerdict::kRight);
    CHECK(right.text().empty());

    const GravityCheck in_g = after_rest({.gravity_mps2 = 1.0}, random);
    CHECK(in_g.verdict() == GravityVerdict::kInG);
    CHECK(in_g.scale() == Approx(9.81));

    const GravityCheck sign = after_rest({.force_of = -Eigen::Matrix3d::Identity()}, random);
    CHECK(sign.verdict() == GravityVerdict::kPointsDown);
    CHECK_THAT(sign.text(), Contains("sign"));
    const GravityCheck upside_down =
        after_rest({.force_of = turned(std::numbers::pi, level_axis)}, random);
    CHECK(upside_down.verdict() == GravityVerdict::kPointsDown);
    CHECK_THAT(upside_down.text(), Contains("roll_rad"));

    const GravityCheck tilted =
        after_rest({.force_of = turned(0.5 * std::numbers::pi, level_axis)}, random);
    CHECK(tilted.verdict() == GravityVerdict::kTilted);
    CHECK(after_rest({.gravity_mps2 = 0.0}, random).verdict() == GravityVerdict::kMissing);
    CHECK(after_rest({.gravity_mps2 = 9810.0}, random).verdict() == GravityVerdict::kWrongScale);
  }
}

TEST_CASE("What the text proposes as a mounting makes gravity upwards", "[gravity]") {
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const GravityCheck wrong =
        after_rest({.force_of = turned(2.0, Eigen::Vector3d::UnitY())}, random);
    double roll_rad = 0.0;
    double pitch_rad = 0.0;
    const std::string text = wrong.text();
    REQUIRE(std::sscanf(text.c_str() + text.find("roll_rad"), "roll_rad = %lf, pitch_rad = %lf",
                        &roll_rad, &pitch_rad) == 2);
    const SensorMount proposed{0.0, 0.0, 0.0, roll_rad, pitch_rad, 0.0};
    const Eigen::Vector3d force = proposed.rotation() * wrong.mean_mps2();
    CHECK(force.normalized().z() > std::cos(0.02));
  }
}

TEST_CASE("An acceleration in g gives the motion of one in m/s^2", "[gravity]") {
  test::Drive drive;
  drive.stand_s = 4.0;
  std::mt19937_64 random(2);
  LidarImuInput metric(test::parameters_for_drive());
  LidarImuInput in_g(test::parameters_for_drive());
  int told = 0;
  for (model::Utime t = 0; test::seconds(t) < 20.0; t += 10'000) {
    model::ImuSample sample = test::imu_at(drive, t, 100.0, noise(), random);
    metric.add(sample);
    sample.specific_force_mps2 /= 9.81;
    for (const InputResult& result : in_g.add(sample)) {
      const auto* fault = std::get_if<InputFault>(&result);
      if (fault == nullptr || fault->kind != InputFaultKind::kUnit) continue;
      ++told;
      CHECK(test::seconds(t) < 1.0);
    }
  }
  CHECK(told == 1);
  CHECK(in_g.gravity().text().empty());
  const geometry::SE2 moved = metric.motion().raw_pose().odom_T_vehicle;
  CHECK(moved.translation().norm() > 10.0);
  CHECK((in_g.motion().raw_pose().odom_T_vehicle.translation() - moved.translation()).norm() < 0.5);
}

TEST_CASE("A sensor is silent for as long as it is, and from the start where it is expected",
          "[faults]") {
  LidarImuInputParameters parameters = test::parameters_for_drive();
  parameters.expected.sweep = true;
  LidarImuInput input(parameters);
  test::Drive drive;
  std::mt19937_64 random(2);
  for (model::Utime t = 0; test::seconds(t) < 30.0; t += 10'000) {
    input.add(test::wheels_at(drive, t, noise(), random));
    const bool is_gone = test::seconds(t) >= 5.0 && test::seconds(t) < 25.0;
    if (!is_gone) input.add(test::imu_at(drive, t, 100.0, noise(), random));
    CAPTURE(t);
    if (test::seconds(t) > 0.4) CHECK(input.is_silent(Sensor::kSweep));
    CHECK_FALSE(input.is_silent(Sensor::kScan));
    CHECK_FALSE(input.is_silent(Sensor::kWheels));
    const double since_s = test::seconds(t) - 5.0;
    if (since_s > 0.35 && since_s < 19.9) CHECK(input.is_silent(Sensor::kImu));
    if (since_s < 0.25 || since_s > 20.1) CHECK_FALSE(input.is_silent(Sensor::kImu));
  }
}
