// Standstills without wheels: quiet samples do not distinguish them from a smooth road.
#include <random>

#include "services/lidar_imu_input/motion_estimator.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

constexpr model::Utime kStep_us = 5'000;
constexpr double kStart_s = 22.0;
constexpr double kSpeedUp_s = 3.0;
constexpr double kStop_s = 45.0;

/// From a standstill to 3 m/s, evenly on over a smooth straight road, and to a stop.
double acceleration_at(double time_s) {
  if (time_s >= kStart_s && time_s < kStart_s + kSpeedUp_s) return 1.0;
  if (time_s >= kStop_s && time_s < kStop_s + kSpeedUp_s) return -1.0;
  return 0.0;
}

struct Stationary {
  double on_the_road_s = 0.0;  ///< Found stationary while driving evenly.
  double at_the_end_s = 0.0;   ///< The same in the last seconds, when it is.
};

/// `corrects`: a filter corrects the velocity ten times a second.
Stationary drive_smoothly(bool corrects) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise;
  MotionEstimator motion(test::parameters_for_drive());
  Stationary is_stationary;
  double velocity = 0.0;
  for (model::Utime t = 0; test::seconds(t) < 60.0; t += kStep_us) {
    const double acceleration = acceleration_at(test::seconds(t));
    velocity += acceleration * test::seconds(kStep_us);
    model::ImuSample sample;
    sample.utime = t;
    for (int axis = 0; axis < 3; ++axis) {
      sample.angular_rate_rad_s(axis) = 2e-3 * noise(random);
      sample.specific_force_mps2(axis) = 0.03 * noise(random);
    }
    sample.specific_force_mps2 += Eigen::Vector3d(acceleration, 0.0, kGravity_mps2);
    motion.add_imu(motion.to_vehicle(sample), false);
    if (corrects && t % 100'000 == 0) {
      model::VelocityCorrection correction;
      correction.utime = t;
      correction.velocity_mps = {velocity, 0.0};
      correction.covariance.diagonal() << 1e-4, 1e-4, 1e-8, 1e-4, 1e-4;
      motion.add_correction(correction);
    }
    if (!motion.is_stationary()) continue;
    const double now = test::seconds(t);
    if (now > kStart_s + kSpeedUp_s && now < kStop_s)
      is_stationary.on_the_road_s += test::seconds(kStep_us);
    if (now > 55.0) is_stationary.at_the_end_s += test::seconds(kStep_us);
  }
  return is_stationary;
}

}  // namespace

TEST_CASE("a smooth road is no standstill where the filter knows the velocity", "[standstill]") {
  const Stationary alone = drive_smoothly(false);
  const Stationary corrected = drive_smoothly(true);
  CAPTURE(alone.on_the_road_s, corrected.on_the_road_s, corrected.at_the_end_s);
  CHECK(alone.on_the_road_s > 1.0);  // The samples are as quiet as that.
  CHECK(corrected.on_the_road_s == 0.0);
  CHECK(corrected.at_the_end_s > 4.5);
}
