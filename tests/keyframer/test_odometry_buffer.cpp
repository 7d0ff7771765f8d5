#include "common/model/odometry_buffer.hpp"

#include <cmath>

#include "common/model/archive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr model::Utime kIncrement_us = 100'000;
constexpr double kBias = 2e-3;  // rad/s

/// Straight on at 10 m/s, integrated with a gyro that is off by kBias.
model::Odometry increment(int k) {
  model::Odometry odometry;
  odometry.from_utime = k * kIncrement_us;
  odometry.utime = (k + 1) * kIncrement_us;
  odometry.from_T_to = geometry::SE2::Exp({1.0, 0.0, kBias * 0.1});
  odometry.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  odometry.has_wheels = true;
  odometry.inertial.emplace();
  odometry.inertial->seconds = 0.1;
  odometry.inertial->yaw_rad = kBias * 0.1;
  odometry.inertial->bias_jacobian(0, 0) = -0.1;
  return odometry;
}

}  // namespace

TEST_CASE("The filter's bias straightens the increments that come after it", "[odometry]") {
  model::OdometryBuffer buffer;
  for (int k = 0; k < 10; ++k) REQUIRE(buffer.add(increment(k)));
  buffer.set_bias({kBias, 0.0, 0.0});
  for (int k = 10; k < 20; ++k) REQUIRE(buffer.add(increment(k)));

  const auto before = buffer.between(0, 10 * kIncrement_us);
  const auto after = buffer.between(10 * kIncrement_us, 20 * kIncrement_us);
  REQUIRE(before);
  REQUIRE(after);
  REQUIRE(std::abs(before->mean.theta() - kBias) < 1e-12);
  REQUIRE((after->mean.coordinates() - Eigen::Vector3d(10.0, 0.0, 0.0)).norm() < 1e-12);
}

TEST_CASE("A stationary vehicle does not rotate, whatever the bias", "[odometry]") {
  model::OdometryBuffer buffer;
  buffer.set_bias({kBias, 0.0, 0.0});
  model::Odometry stationary = increment(0);
  stationary.from_T_to = geometry::SE2();
  stationary.is_stationary = true;
  REQUIRE(buffer.add(stationary));
  REQUIRE(buffer.between(0, kIncrement_us)->mean.coordinates().norm() == 0.0);
}

namespace {

/// The filter at the end of increment k-1: its speed is more certain than that of the wheels, which
/// are 2 % off.
model::EkfPose filter_at(int k, double speed_mps, double sigma_mps) {
  model::EkfPose pose;
  pose.utime = k * kIncrement_us;
  pose.velocity_mps << speed_mps, 0.0;
  pose.velocity_covariance = sigma_mps * sigma_mps * Eigen::Matrix2d::Identity();
  pose.bias << kBias, 0.0, 0.0;
  return pose;
}

model::Odometry wheel_increment(int k) {
  model::Odometry odometry = increment(k);
  odometry.from_T_to = geometry::SE2::Exp({1.02, 0.0, kBias * 0.1});
  odometry.covariance = 1e-3 * Eigen::Matrix3d::Identity();
  odometry.inertial->covariance = 1e-8 * Eigen::Matrix<double, 5, 5>::Identity();
  return odometry;
}

}  // namespace

TEST_CASE("Increments start at the filter's velocity where that is more certain", "[odometry]") {
  for (const bool is_sure : {true, false}) {
    model::OdometryBuffer buffer;
    buffer.set_filter_pose(filter_at(0, 10.0, is_sure ? 0.02 : 2.0));
    for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(wheel_increment(k)));
    const auto motion = buffer.between(0, 5 * kIncrement_us);
    REQUIRE(motion);
    REQUIRE(std::abs(motion->mean.x() - (is_sure ? 5.0 : 5.1)) < 1e-6);
    REQUIRE(std::abs(motion->mean.theta()) < 1e-9);
    // 0.02 m/s, correlated over 0.5 s: five times 0.02^2 * 0.1 * 0.5, and the IMU's own.
    if (is_sure) REQUIRE(std::abs(motion->covariance(0, 0) - 1e-4) < 1.2e-7);
  }
}

TEST_CASE("The filter's pose has the same effect, late or in time", "[odometry]") {
  model::OdometryBuffer late;
  model::OdometryBuffer in_time;
  for (int k = 0; k < 3; ++k) {
    REQUIRE(in_time.add(wheel_increment(k)));
    REQUIRE(late.add(wheel_increment(k)));
    if (k == 0) in_time.set_filter_pose(filter_at(1, 10.0, 0.02));
  }
  late.set_filter_pose(filter_at(1, 10.0, 0.02));
  for (model::OdometryBuffer* one : {&late, &in_time}) REQUIRE(one->add(wheel_increment(3)));
  const auto a = in_time.between(3 * kIncrement_us, 4 * kIncrement_us);
  const auto b = late.between(3 * kIncrement_us, 4 * kIncrement_us);
  REQUIRE(a->mean.x() < 1.001);
  REQUIRE((a->mean.coordinates() - b->mean.coordinates()).norm() < 1e-12);
  REQUIRE((a->covariance - b->covariance).norm() < 1e-15);
}

TEST_CASE("On a curve the filter's velocity turns with the vehicle", "[odometry]") {
  // A circle at 10 m/s and 1 rad/s; the wheels are 2 % off.
  const geometry::SE2 step = geometry::SE2::Exp({1.0, 0.0, 0.1});
  const Eigen::Vector2d velocity(10.0, 0.0);
  const auto curved = [&](int k) {
    model::Odometry odometry = wheel_increment(k);
    odometry.from_T_to = geometry::SE2::Exp({1.02, 0.0, 0.1});
    odometry.inertial->yaw_rad = 0.1;
    odometry.inertial->velocity_mps = step.rotation() * velocity - velocity;
    odometry.inertial->position_m = step.translation() - 0.1 * velocity;
    odometry.inertial->bias << kBias, 0.0, 0.0;
    return odometry;
  };
  model::OdometryBuffer buffer;
  buffer.set_filter_pose(filter_at(0, 10.0, 0.02));
  for (int k = 0; k < 10; ++k) REQUIRE(buffer.add(curved(k)));
  const auto motion = buffer.between(0, 10 * kIncrement_us);
  REQUIRE(motion);
  REQUIRE((motion->mean.inverse() * geometry::SE2::Exp({10.0, 0.0, 1.0})).Log().norm() < 1e-6);
  REQUIRE((buffer.velocity()->velocity_mps - velocity).norm() < 1e-6);
}

TEST_CASE("After a gap the filter's velocity is not known", "[odometry]") {
  model::OdometryBuffer buffer;
  buffer.set_filter_pose(filter_at(0, 10.0, 0.02));
  REQUIRE(buffer.add(wheel_increment(3)));
  REQUIRE(std::abs(buffer.between(3 * kIncrement_us, 4 * kIncrement_us)->mean.x() - 1.02) < 1e-6);
  REQUIRE(!buffer.velocity());
}

TEST_CASE("A restored buffer gives the same motion and continues with the same bias",
          "[odometry]") {
  model::OdometryBuffer buffer;
  buffer.set_filter_pose(filter_at(0, 10.0, 1e-4));
  for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(increment(k)));
  model::OdometryBuffer restored;
  state::load(state::save({"buffer", 1}, buffer), {"buffer", 1}, restored);
  for (model::OdometryBuffer* one : {&buffer, &restored}) REQUIRE(one->add(increment(5)));
  const geometry::SE2 a = buffer.between(0, 6 * kIncrement_us)->mean;
  const geometry::SE2 b = restored.between(0, 6 * kIncrement_us)->mean;
  REQUIRE(a.coordinates() == b.coordinates());
}

TEST_CASE("A gyro's rotation adds up, with the bias that was subtracted", "[odometry]") {
  model::OdometryBuffer buffer(0.0);
  model::EkfPose filter = filter_at(0, 10.0, 0.02);
  filter.bias_covariance(0, 0) = 1e-6;
  buffer.set_filter_pose(filter);
  for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(wheel_increment(k)));
  const auto rotation = buffer.gyro_rotation(kIncrement_us / 2, 3 * kIncrement_us);
  REQUIRE(rotation);
  CHECK(std::abs(rotation->rotation_rad) < 1e-12);
  CHECK(std::abs(rotation->seconds - 0.25) < 1e-12);
  CHECK(std::abs(rotation->bias_rad - 0.25 * kBias) < 1e-12);
  // White noise alone: the error of the bias is a variable of its own.
  CHECK(std::abs(rotation->variance - 2.5e-8) < 1e-12);
  CHECK(!buffer.gyro_rotation(0, 6 * kIncrement_us));
  model::Odometry blind = wheel_increment(5);
  blind.inertial.reset();
  REQUIRE(buffer.add(blind));
  CHECK(!buffer.gyro_rotation(0, 6 * kIncrement_us));
}
