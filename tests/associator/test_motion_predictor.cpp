// Which measurement predicts the motion to the next scan.
#include "services/associator/motion_predictor.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

constexpr model::Utime kStart_us = 1'000'000;
constexpr model::Utime kStep_us = 100'000;

/// Increment k: 1 m by wheels, or 0.9 m by an IMU whose velocity is not known well.
model::Odometry increment(int k, bool has_wheels, bool has_imu) {
  model::Odometry odometry;
  odometry.from_utime = kStart_us + k * kStep_us;
  odometry.utime = odometry.from_utime + kStep_us;
  odometry.from_T_to = geometry::SE2(has_wheels ? 1.0 : 0.9, 0.0, 0.0);
  odometry.covariance = (has_wheels ? 1e-4 : 1.0) * Eigen::Matrix3d::Identity();
  odometry.has_wheels = has_wheels;
  if (has_imu) odometry.inertial.emplace().seconds = 0.1;
  return odometry;
}

/// The filter at the start: 10.5 m/s, so 1.05 m per scan.
model::EkfPose filter_pose() {
  model::EkfPose pose;
  pose.utime = kStart_us;
  pose.velocity_mps << 10.5, 0.0;
  pose.velocity_covariance = 1e-4 * Eigen::Matrix2d::Identity();
  return pose;
}

MotionPredictor after_first_scan() {
  MotionPredictor predictor((AssociatorParameters()));
  predictor.set_scan(kStart_us, {});
  return predictor;
}

double shift_m(const MotionPredictor& predictor, int steps = 1) {
  return predictor.predict(kStart_us + steps * kStep_us).last_T_now.mean.x();
}

}  // namespace

TEST_CASE("Wheels predict the motion, then the filter, then the IMU", "[associator][motion]") {
  MotionPredictor wheels = after_first_scan();
  wheels.add(increment(0, true, true));
  wheels.add(filter_pose());
  CHECK(shift_m(wheels) == Approx(1.0));

  MotionPredictor filter = after_first_scan();
  filter.add(increment(0, false, true));
  CHECK(shift_m(filter) == Approx(0.9));
  filter.add(filter_pose());
  CHECK(shift_m(filter) == Approx(1.05));
  CHECK_FALSE(filter.predict(kStart_us + kStep_us).is_extrapolated);
}

TEST_CASE("A filter pose of another scan predicts nothing", "[associator][motion]") {
  MotionPredictor predictor = after_first_scan();
  model::EkfPose pose = filter_pose();
  pose.utime -= kStep_us;
  predictor.add(pose);
  CHECK(predictor.predict(kStart_us + kStep_us).is_extrapolated);
}

TEST_CASE("Without a measurement the last motion repeats in proportion to time",
          "[associator][motion]") {
  MotionPredictor predictor = after_first_scan();
  predictor.set_scan(kStart_us + kStep_us, geometry::SE2(0.8, 0.0, 0.0));
  const PredictedMotion one = predictor.predict(kStart_us + 2 * kStep_us);
  const PredictedMotion two = predictor.predict(kStart_us + 3 * kStep_us);
  CHECK(one.is_extrapolated);
  CHECK(one.last_T_now.mean.x() == Approx(0.8));
  const Eigen::Vector3d variances = one.last_T_now.covariance.diagonal();
  CHECK(variances.isApprox(Eigen::Vector3d(0.09, 0.09, 0.0016), 1e-6));
  CHECK(two.last_T_now.mean.x() == Approx(1.6));
  CHECK(two.last_T_now.covariance(0, 0) == Approx(4.0 * one.last_T_now.covariance(0, 0)));
}

TEST_CASE("Only wheels with a gyro decide whether a track moves", "[associator][motion]") {
  for (const bool has_wheels : {true, false}) {
    for (const bool has_imu : {true, false}) {
      MotionPredictor predictor = after_first_scan();
      predictor.add(increment(0, has_wheels, has_imu));
      const auto motion = predictor.by_wheels(kStart_us, kStart_us + kStep_us);
      CHECK(motion.has_value() == (has_wheels && has_imu));
    }
  }
}

TEST_CASE("Odometry starts anew when the clock was set back", "[associator][motion]") {
  MotionPredictor predictor = after_first_scan();
  predictor.add(increment(200, true, true));
  predictor.add(increment(0, true, true));
  CHECK(shift_m(predictor) == Approx(1.0));
}
