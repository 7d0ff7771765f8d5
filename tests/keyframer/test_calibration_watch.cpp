#include "services/keyframer/joint/calibration_watch.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory;
using keyframer::CalibrationError;
using keyframer::joint::CalibrationWatch;

namespace {

struct Wrong {
  double yaw_rad = 0.0;
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double scale = 0.0;
};

/// A vehicle that winds along at 3 m/s; landmarks show its motion over 0.4 s, wheels that over
/// 0.1 s.
CalibrationError after(double seconds, const Wrong& wrong, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double sigma_landmarks_m = 0.02;
  const double sigma_wheels_m = 0.004;
  const geometry::SE2 mounting(wrong.place_m, wrong.yaw_rad);

  CalibrationWatch watch;
  std::vector<geometry::SE2> path(1);
  for (int k = 1; k <= static_cast<int>(10.0 * seconds); ++k) {
    const geometry::SE2 step = geometry::SE2::Exp({0.3, 0.0, 0.03 * std::sin(0.05 * k)});
    path.push_back(path.back() * step);
    model::Odometry increment;
    increment.from_utime = 100'000 * (k - 1);
    increment.utime = 100'000 * k;
    increment.has_wheels = true;
    increment.from_T_to =
        geometry::SE2((1.0 + wrong.scale) * step.x() + sigma_wheels_m * normal(random),
                      step.y() + sigma_wheels_m * normal(random), step.theta());
    increment.covariance =
        Eigen::Vector3d(sigma_wheels_m * sigma_wheels_m, sigma_wheels_m * sigma_wheels_m, 1e-8)
            .asDiagonal();
    watch.add(increment);
    if (k < 4) continue;

    const geometry::SE2 truth = path[k - 4].inverse() * path[k];
    const geometry::SE2 noise(sigma_landmarks_m * normal(random),
                              sigma_landmarks_m * normal(random), 0.0);
    model::ScanMotion motion{100'000 * (k - 4), 100'000 * k, {}};
    motion.then_T_now.mean = mounting * truth * mounting.inverse() * noise;
    motion.then_T_now.covariance = Eigen::Vector3d(sigma_landmarks_m * sigma_landmarks_m,
                                                   sigma_landmarks_m * sigma_landmarks_m, 1e-6)
                                       .asDiagonal();
    if (watch.is_due(motion.now_utime)) watch.add(motion);
  }
  return watch.error();
}

}  // namespace

TEST_CASE("Where nothing is wrong, errors stay within their sigmas", "[calibration]") {
  double largest_yaw = 0.0;
  double largest_scale = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const CalibrationError error = after(60.0, {}, seed);
    largest_yaw = std::max(largest_yaw, std::abs(error.yaw_rad) / error.yaw_sigma_rad);
    largest_scale = std::max(largest_scale, std::abs(error.scale) / error.scale_sigma);
    CHECK(error.yaw_sigma_rad < 0.004);
    CHECK(error.scale_sigma < 0.004);
  }
  CHECK(largest_yaw < 4.0);
  CHECK(largest_scale < 4.0);
}

TEST_CASE("Yaw of the mounting and scale of the wheels are told apart", "[calibration]") {
  const double yaw = 2.0 * std::numbers::pi / 180.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const CalibrationError turned = after(60.0, {.yaw_rad = yaw, .place_m = {0.5, -0.2}}, seed);
    CHECK(std::abs(turned.yaw_rad - yaw) < 4.0 * turned.yaw_sigma_rad);
    CHECK(std::abs(turned.scale) < 4.0 * turned.scale_sigma);

    const CalibrationError longer = after(60.0, {.scale = 0.03}, seed);
    CHECK(std::abs(longer.scale - 0.03) < 4.0 * longer.scale_sigma);
    CHECK(std::abs(longer.yaw_rad) < 4.0 * longer.yaw_sigma_rad);
  }
}

TEST_CASE("Without wheels nothing is compared", "[calibration]") {
  CalibrationWatch watch;
  model::Odometry increment;
  increment.utime = 100'000;
  increment.from_T_to = geometry::SE2(0.3, 0.0, 0.0);
  increment.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  watch.add(increment);
  watch.add(model::ScanMotion{0, 100'000, {geometry::SE2(0.3, 0.3, 0.0), increment.covariance}});
  CHECK(watch.error().yaw_rad == 0.0);
}

TEST_CASE("A jump of the landmarks against the wheels shows at once", "[calibration]") {
  CalibrationWatch watch;
  const auto drive = [&](int k, double jump_m) {
    model::Odometry increment;
    increment.from_utime = 100'000 * (k - 1);
    increment.utime = 100'000 * k;
    increment.has_wheels = true;
    increment.from_T_to = geometry::SE2(0.3, 0.0, 0.01);
    increment.covariance = Eigen::Vector3d(1e-5, 1e-5, 1e-8).asDiagonal();
    watch.add(increment);

    model::ScanMotion motion{increment.from_utime, increment.utime, {}};
    motion.then_T_now.mean = geometry::SE2(0.3 + jump_m, 0.0, 0.01);
    motion.then_T_now.covariance = Eigen::Vector3d(1e-4, 1e-4, 4e-6).asDiagonal();
    if (watch.is_due(motion.now_utime)) watch.add(motion);
    watch.check(motion);
    return watch.contradicts();
  };
  for (int k = 1; k < 100; ++k) REQUIRE_FALSE(drive(k, 0.0));
  CHECK(drive(100, -0.3));
  CHECK_FALSE(drive(101, 0.0));
  watch.check(std::nullopt);
  CHECK_FALSE(watch.contradicts());
}

TEST_CASE("Scans that are shaken as a whole turn otherwise than the gyro says", "[calibration]") {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto turn_chi2_of = [&](double shaken_rad) {
    CalibrationWatch watch;
    for (int k = 1; k <= 600; ++k) {
      model::Odometry increment;
      increment.from_utime = 100'000 * (k - 1);
      increment.utime = 100'000 * k;
      increment.from_T_to = geometry::SE2(0.3, 0.0, 0.01);
      increment.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-8).asDiagonal();
      watch.add(increment);

      model::ScanMotion motion{increment.from_utime, increment.utime, {}};
      motion.then_T_now.mean =
          geometry::SE2(0.3, 0.0, 0.01 + std::hypot(2e-3, shaken_rad) * normal(random));
      motion.then_T_now.covariance = Eigen::Vector3d(1e-4, 1e-4, 4e-6).asDiagonal();
      watch.check(motion);
    }
    return watch.error().turn_chi2;
  };
  CHECK(turn_chi2_of(0.0) == Approx(1.0).margin(0.25));
  CHECK(turn_chi2_of(0.007) > 6.0);
}
