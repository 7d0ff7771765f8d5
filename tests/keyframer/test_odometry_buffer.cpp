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

TEST_CASE("A restored buffer gives the same motion", "[odometry]") {
  model::OdometryBuffer buffer;
  for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(increment(k)));
  model::OdometryBuffer restored;
  state::load(state::save({"buffer", 1}, buffer), {"buffer", 1}, restored);
  for (model::OdometryBuffer* one : {&buffer, &restored}) REQUIRE(one->add(increment(5)));
  const geometry::SE2 a = buffer.between(0, 6 * kIncrement_us)->mean;
  const geometry::SE2 b = restored.between(0, 6 * kIncrement_us)->mean;
  REQUIRE(a.coordinates() == b.coordinates());
}

TEST_CASE("A gyro's rotation adds up, with the bias that was subtracted", "[odometry]") {
  model::OdometryBuffer buffer;
  for (int k = 0; k < 5; ++k) {
    model::Odometry one = increment(k);
    one.inertial->bias.x() = kBias;
    one.inertial->covariance(0, 0) = 1e-8;
    REQUIRE(buffer.add(one));
  }
  const auto rotation = buffer.gyro_rotation(kIncrement_us / 2, 3 * kIncrement_us);
  REQUIRE(rotation);
  CHECK(std::abs(rotation->rotation_rad - 0.25 * kBias) < 1e-12);
  CHECK(std::abs(rotation->seconds - 0.25) < 1e-12);
  CHECK(std::abs(rotation->bias_rad - 0.25 * kBias) < 1e-12);
  // White noise alone: the error of the bias is a variable of its own.
  CHECK(std::abs(rotation->variance - 2.5e-8) < 1e-12);
  CHECK(!buffer.gyro_rotation(0, 6 * kIncrement_us));

  model::Odometry blind = increment(5);
  blind.inertial.reset();
  REQUIRE(buffer.add(blind));
  CHECK(!buffer.gyro_rotation(0, 6 * kIncrement_us));
}

TEST_CASE("What odometry says reaches its users as it is", "[odometry]") {
  model::OdometryBuffer buffer;
  for (int k = 0; k < 3; ++k) REQUIRE(buffer.add(increment(k)));
  for (int k = 0; k < 3; ++k) {
    const auto motion = buffer.between(k * kIncrement_us, (k + 1) * kIncrement_us);
    REQUIRE(motion);
    CHECK(motion->mean.coordinates() == increment(k).from_T_to.coordinates());
    CHECK(motion->covariance == increment(k).covariance);
  }
}

namespace {

/// The filter at the end of increment k-1.
model::EkfPose filter_at(int k, double speed_mps, double sigma_mps) {
  model::EkfPose pose;
  pose.utime = k * kIncrement_us;
  pose.velocity_mps << speed_mps, 0.0;
  pose.velocity_covariance = sigma_mps * sigma_mps * Eigen::Matrix2d::Identity();
  pose.bias << 5.0, 0.0, 0.0;  // of the gyro: not used
  return pose;
}

/// Dead reckoned, 2 % too fast.
model::Odometry dead_reckoned(int k) {
  model::Odometry odometry = increment(k);
  odometry.from_T_to = geometry::SE2::Exp({1.02, 0.0, kBias * 0.1});
  odometry.covariance = 1e-3 * Eigen::Matrix3d::Identity();
  odometry.has_wheels = false;
  odometry.inertial->covariance = 1e-8 * Eigen::Matrix<double, 5, 5>::Identity();
  return odometry;
}

}  // namespace

TEST_CASE("Without wheels increments start at the filter's velocity where that is more certain",
          "[odometry]") {
  for (const bool is_sure : {true, false}) {
    model::OdometryBuffer buffer;
    buffer.set_filter_velocity(filter_at(0, 10.0, is_sure ? 0.02 : 2.0));
    for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(dead_reckoned(k)));
    const auto motion = buffer.between(0, 5 * kIncrement_us);
    REQUIRE(motion);
    CHECK(std::abs(motion->mean.x() - (is_sure ? 5.0 : 5.1)) < 1e-5);
    CHECK(std::abs(motion->mean.theta() - 0.5 * kBias) < 1e-9);
    // 0.02 m/s, correlated over 0.5 s and inflated by 4: five times 4 * 0.02^2 * 0.1 * 0.5.
    if (is_sure) CHECK(std::abs(motion->covariance(0, 0) - 4e-4) < 1e-5);
  }
}

TEST_CASE("The filter's velocity never touches wheels, and ends with a gap", "[odometry]") {
  model::OdometryBuffer buffer;
  buffer.set_filter_velocity(filter_at(0, 7.0, 1e-4));
  for (int k = 0; k < 3; ++k) REQUIRE(buffer.add(increment(k)));
  CHECK(buffer.between(0, 3 * kIncrement_us)->mean.x() == Approx(3.0).margin(1e-4));

  REQUIRE(buffer.add(dead_reckoned(5)));
  CHECK(buffer.between(5 * kIncrement_us, 6 * kIncrement_us)->mean.x() ==
        Approx(1.02).margin(1e-6));
}

TEST_CASE("The filter's velocity has the same effect, late or in time", "[odometry]") {
  model::OdometryBuffer late;
  model::OdometryBuffer in_time;
  for (int k = 0; k < 3; ++k) {
    REQUIRE(in_time.add(dead_reckoned(k)));
    REQUIRE(late.add(dead_reckoned(k)));
    if (k == 0) in_time.set_filter_velocity(filter_at(1, 10.0, 0.02));
  }
  late.set_filter_velocity(filter_at(1, 10.0, 0.02));
  for (model::OdometryBuffer* one : {&late, &in_time}) REQUIRE(one->add(dead_reckoned(3)));
  const auto a = in_time.between(3 * kIncrement_us, 4 * kIncrement_us);
  const auto b = late.between(3 * kIncrement_us, 4 * kIncrement_us);
  CHECK(a->mean.x() < 1.001);
  CHECK((a->mean.coordinates() - b->mean.coordinates()).norm() < 1e-12);
  CHECK((a->covariance - b->covariance).norm() < 1e-15);
}
