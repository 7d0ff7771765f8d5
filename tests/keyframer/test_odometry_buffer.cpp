#include "common/model/odometry_buffer.hpp"

#include <cmath>

#include "common/model/state.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr Utime kPiece_us = 100'000;
constexpr double kBias = 2e-3;  // rad/s

/// Straight on at 10 m/s, integrated with a gyro that is off by kBias.
Odometry piece(int k) {
  Odometry odometry;
  odometry.from_utime = k * kPiece_us;
  odometry.utime = (k + 1) * kPiece_us;
  odometry.from_T_to = SE2::Exp({1.0, 0.0, kBias * 0.1});
  odometry.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  odometry.has_wheels = true;
  odometry.inertial.emplace();
  odometry.inertial->seconds = 0.1;
  odometry.inertial->yaw_rad = kBias * 0.1;
  odometry.inertial->bias_jacobian(0, 0) = -0.1;
  return odometry;
}

}  // namespace

TEST_CASE("The filter's bias straightens the pieces that come after it", "[odometry]") {
  OdometryBuffer buffer;
  for (int k = 0; k < 10; ++k) REQUIRE(buffer.add(piece(k)));
  buffer.set_bias({kBias, 0.0, 0.0});
  for (int k = 10; k < 20; ++k) REQUIRE(buffer.add(piece(k)));

  const auto before = buffer.between(0, 10 * kPiece_us);
  const auto after = buffer.between(10 * kPiece_us, 20 * kPiece_us);
  REQUIRE(before);
  REQUIRE(after);
  REQUIRE(std::abs(before->mean.theta() - kBias) < 1e-12);
  REQUIRE((after->mean.coordinates() - Eigen::Vector3d(10.0, 0.0, 0.0)).norm() < 1e-12);
}

TEST_CASE("A standing vehicle does not turn, whatever the bias", "[odometry]") {
  OdometryBuffer buffer;
  buffer.set_bias({kBias, 0.0, 0.0});
  Odometry standing = piece(0);
  standing.from_T_to = SE2();
  standing.is_standing = true;
  REQUIRE(buffer.add(standing));
  REQUIRE(buffer.between(0, kPiece_us)->mean.coordinates().norm() == 0.0);
}

TEST_CASE("A restored buffer tells the same motion and goes on with the same bias", "[odometry]") {
  OdometryBuffer buffer;
  buffer.set_bias({kBias, 0.0, 0.0});
  for (int k = 0; k < 5; ++k) REQUIRE(buffer.add(piece(k)));
  OdometryBuffer restored;
  Json(buffer).get_to(restored);
  for (OdometryBuffer* one : {&buffer, &restored}) REQUIRE(one->add(piece(5)));
  const SE2 a = buffer.between(0, 6 * kPiece_us)->mean;
  const SE2 b = restored.between(0, 6 * kPiece_us)->mean;
  REQUIRE(a.coordinates() == b.coordinates());
}
