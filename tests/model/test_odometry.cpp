// Recent odometry: gaps that are rounding, and motion inside an increment.
#include <cmath>

#include "common/model/odometry_buffer.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::model;

namespace {

constexpr Utime kIncrement_us = 100'000;
const Eigen::Vector3d kTwist(1.0, 0.05, 0.2);  // of an increment: m, m, rad

/// A curve at constant twist; the second increment begins `gap_us` late. With an IMU.
OdometryBuffer two_increments(Utime gap_us) {
  OdometryBuffer buffer;
  for (int k = 0; k < 2; ++k) {
    Odometry odometry;
    odometry.from_utime = k * kIncrement_us + (k == 1 ? gap_us : 0);
    odometry.utime = (k + 1) * kIncrement_us;
    odometry.from_T_to = geometry::SE2::Exp(kTwist);
    odometry.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    odometry.inertial.emplace().seconds = 0.1;
    REQUIRE(buffer.add(odometry));
  }
  return buffer;
}

}  // namespace

TEST_CASE("Inside an increment the twist is constant, and the covariance grows with time",
          "[model]") {
  const OdometryBuffer buffer = two_increments(0);
  for (int from = 0; from <= 20; ++from) {
    for (int to = from; to <= 20; ++to) {
      const auto motion = buffer.between(from * 10'000, to * 10'000);
      REQUIRE(motion);
      const double part = 0.1 * (to - from);
      CHECK((motion->mean.Log() - part * kTwist).norm() < 1e-12);
      // Of a heading the share of time alone: what comes before does not change it.
      CHECK(motion->covariance(2, 2) == Approx(1e-4 * part).margin(1e-18));
    }
  }
}

TEST_CASE("A gap of a millisecond is rounding, a longer one is a gap", "[model]") {
  for (const Utime gap_us : {-1000, 0, 1, 999, 1000, 1001, 5000}) {
    CAPTURE(gap_us);
    const OdometryBuffer buffer = two_increments(gap_us);
    CHECK(buffer.between(0, 2 * kIncrement_us).has_value() == (gap_us <= 1000));
  }
}
