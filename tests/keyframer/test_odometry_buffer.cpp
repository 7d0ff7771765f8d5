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
