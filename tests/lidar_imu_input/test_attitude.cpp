#include <algorithm>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

constexpr double kDegree = M_PI / 180.0;

struct TiltErrors {
  double worst_rad = 0.0;  ///< From 5 s of driving on: by then the wheels' scale is known.
  double rms_rad = 0.0;
  double mean_nees = 0.0;  ///< 2 degrees of freedom.
};

TiltErrors drive_and_compare(const test::Drive& drive, const test::SensorErrors& errors,
                             bool has_wheels, double length_s, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  MotionEstimator motion(test::parameters_for_drive());
  TiltErrors result;
  int count = 0;
  for (model::Utime t = 0; test::seconds(t) < length_s; t += 10'000) {
    motion.add_imu(motion.to_vehicle(imu_at(drive, t, 100.0, errors, random)), false);
    if (has_wheels && t % 20'000 == 0) motion.add_wheels(wheels_at(drive, t, errors, random));
    if (test::seconds(t) < drive.stand_s) continue;
    const RollPitchYaw is = roll_pitch_yaw(motion.attitude()->level_Q_vehicle());
    const Eigen::Vector2d error(is.roll_rad - drive.roll(test::seconds(t)),
                                is.pitch_rad - drive.pitch(test::seconds(t)));
    if (drive.moving(test::seconds(t)) > 5.0)
      result.worst_rad = std::max(result.worst_rad, error.cwiseAbs().maxCoeff());
    result.rms_rad += 0.5 * error.squaredNorm();
    result.mean_nees += error.dot(motion.attitude()->tilt_covariance().ldlt().solve(error));
    ++count;
  }
  result.rms_rad = std::sqrt(result.rms_rad / count);
  result.mean_nees /= count;
  return result;
}

}  // namespace

TEST_CASE("roll and pitch stay within 0.3 degrees while driving", "[attitude]") {
  std::mt19937_64 random(1);
  for (std::uint64_t run = 0; run < 5; ++run) {
    const test::SensorErrors errors = usual_errors(random);
    const TiltErrors tilt = drive_and_compare({}, errors, true, 110.0, run);
    CAPTURE(run, tilt.worst_rad / kDegree, tilt.rms_rad / kDegree, tilt.mean_nees);
    CHECK(tilt.worst_rad < 0.3 * kDegree);
    CHECK(tilt.rms_rad < 0.15 * kDegree);
    CHECK(tilt.mean_nees < 8.0);
  }
}

TEST_CASE("without wheels the calibrated gyro carries roll and pitch", "[attitude]") {
  std::mt19937_64 random(2);
  for (std::uint64_t run = 0; run < 3; ++run) {
    const test::SensorErrors errors = usual_errors(random);
    const TiltErrors tilt = drive_and_compare({}, errors, false, 110.0, run);
    CAPTURE(run, tilt.worst_rad / kDegree, tilt.rms_rad / kDegree, tilt.mean_nees);
    CHECK(tilt.worst_rad < 0.6 * kDegree);
    CHECK(tilt.mean_nees < 8.0);
  }
}

TEST_CASE("a standstill is found, and a smooth drive is none", "[attitude][standstill]") {
  std::mt19937_64 random(3);
  test::Drive drive;
  drive.rough_rad = 0.002;
  test::SensorErrors errors;
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  for (const bool has_wheels : {true, false}) {
    MotionEstimator motion(test::parameters_for_drive());
    int found_while_driving = 0;
    int found_while_stationary = 0;
    for (model::Utime t = 0; test::seconds(t) < 60.0; t += 10'000) {
      motion.add_imu(motion.to_vehicle(imu_at(drive, t, 100.0, errors, random)), false);
      if (has_wheels) motion.add_wheels(wheels_at(drive, t, errors, random));
      if (test::seconds(t) > 1.0 && test::seconds(t) < 21.0)
        found_while_stationary += motion.is_stationary();
      if (drive.speed(test::seconds(t)) > 0.5) found_while_driving += motion.is_stationary();
    }
    CHECK(motion.is_calibrated());
    CHECK(found_while_stationary > 1950);  // of 2000
    CHECK(found_while_driving == 0);
  }
}

TEST_CASE("a start that is no standstill is no calibration", "[attitude][standstill]") {
  std::mt19937_64 random(4);
  test::Drive drive;
  drive.stand_s = 0.0;
  LidarImuInput input(test::parameters_for_drive());
  int reported = 0;
  for (model::Utime t = 0; test::seconds(t) < 30.0; t += 10'000) {
    for (const InputResult& result : input.add(imu_at(drive, t + 1, 100.0, {}, random))) {
      const auto* fault = std::get_if<InputFault>(&result);
      reported += fault != nullptr && fault->kind == InputFaultKind::kNotCalibrated;
    }
  }
  CHECK_FALSE(input.motion().is_calibrated());
  CHECK(reported == 1);
}

TEST_CASE("the mount of the IMU is taken out", "[attitude]") {
  // The same motion felt by an IMU that is turned and sits away from the vehicle's origin.
  test::Drive drive;
  std::mt19937_64 random(5);
  LidarImuInputParameters parameters = test::parameters_for_drive();
  parameters.imu.mount = {0.8, -0.3, 0.5, 0.1, -0.2, 1.5};
  MotionEstimator motion(parameters);
  const Eigen::Vector3d lever = parameters.imu.mount.position_m();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  int count = 0;
  for (model::Utime t = 0; test::seconds(t) < 40.0; t += 5'000) {
    constexpr double h = 1e-4;
    const double at = test::seconds(t) + 1.0;
    const Eigen::Vector3d rate = drive.rate(at);
    const Eigen::Vector3d change = (drive.rate(at + h) - drive.rate(at - h)) / (2.0 * h);
    model::ImuSample raw;
    raw.utime = t;
    const Eigen::Quaterniond back = parameters.imu.mount.rotation().conjugate();
    raw.angular_rate_rad_s = back * rate;
    raw.specific_force_mps2 =
        back * (drive.force(at) + change.cross(lever) + rate.cross(rate.cross(lever)));
    const model::ImuSample sample = motion.to_vehicle(raw);
    CHECK((sample.angular_rate_rad_s - rate).norm() < 1e-9);
    if (t > 0) error += sample.specific_force_mps2 - drive.force(at);
    ++count;
  }
  CHECK((error / count).norm() < 2e-3);
}
