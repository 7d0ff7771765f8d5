// Where the map begins.
#include <cmath>

#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// A tenth of a second by IMU, without motion.
model::Odometry increment_at(int k, bool is_stationary) {
  model::Odometry increment;
  increment.from_utime = model::Utime{100000} * k;
  increment.utime = increment.from_utime + 100000;
  increment.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  increment.is_stationary = is_stationary;
  model::Preintegration& inertial = increment.inertial.emplace();
  inertial.seconds = 0.1;
  inertial.covariance = 1e-8 * Eigen::Matrix<double, 5, 5>::Identity();
  inertial.bias_jacobian(0, 0) = -0.1;
  for (int axis = 1; axis <= 2; ++axis) {
    inertial.bias_jacobian(axis, axis) = -0.1;
    inertial.bias_jacobian(axis + 2, axis) = -0.005;
  }
  return increment;
}

model::TrackedScan scan_after(const model::Odometry& increment) {
  model::TrackedScan scan;
  scan.utime = increment.utime;
  scan.field_of_view.max_range_m = 30.0;
  model::Detection detection;
  detection.position_m << 8.0, 3.0, 1.0;
  detection.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
  scan.landmarks.push_back({1, 0, detection});
  return scan;
}

/// Increments until the vehicle is found to be stationary after half a second; the last pose.
model::EkfPose found_stationary(const EkfParameters& parameters) {
  Ekf filter(parameters);
  EkfOutput output;
  for (int k = 0; k < 10; ++k) {
    const model::Odometry increment = increment_at(k, k >= 5);
    filter.add(increment);
    output = filter.add(scan_after(increment));
    if (parameters.prior.wait_s > 0.0) REQUIRE(output.pose.has_value() == (k >= 5));
  }
  return *output.pose;
}

}  // namespace

TEST_CASE("The map begins where the vehicle is found to be stationary", "[ekf][begin]") {
  const model::EkfPose waited = found_stationary(EkfParameters{});
  EkfParameters hasty;
  hasty.prior.wait_s = 0.0;
  const model::EkfPose at_once = found_stationary(hasty);
  for (int axis = 0; axis < 3; ++axis) {
    CAPTURE(axis, waited.covariance(axis, axis), at_once.covariance(axis, axis));
    CHECK(waited.covariance(axis, axis) < 1.5e-7);
    CHECK(at_once.covariance(axis, axis) > 4.0 * waited.covariance(axis, axis));
  }
}

TEST_CASE("A vehicle that moves by its wheels begins at once, a stationary one waits",
          "[ekf][begin]") {
  for (const bool moves : {true, false}) {
    Ekf filter(EkfParameters{});
    model::Odometry increment = increment_at(0, false);
    increment.has_wheels = true;
    increment.from_T_to = geometry::SE2(moves ? 0.5 : 0.0, 0.0, 0.0);
    filter.add(increment);
    CHECK(filter.add(scan_after(increment)).pose.has_value() == moves);
  }
}

TEST_CASE("A vehicle that moves without wheels begins after wait_s, over a restart too",
          "[ekf][begin]") {
  const EkfParameters parameters;
  Ekf filter(parameters);
  int begun = 0;
  for (int k = 1; k <= 20 && begun == 0; ++k) {
    const model::Odometry increment = increment_at(k - 1, false);
    filter.add(increment);
    if (filter.add(scan_after(increment)).pose) begun = k;
    Ekf other(parameters);
    other.load(filter.save());
    filter = other;
  }
  CHECK(begun == 1 + static_cast<int>(std::lround(10.0 * parameters.prior.wait_s)));
}

TEST_CASE("Scans alone begin at once", "[ekf][begin]") {
  Ekf filter(EkfParameters{});
  CHECK(filter.add(scan_after(increment_at(0, false))).pose.has_value());
}
