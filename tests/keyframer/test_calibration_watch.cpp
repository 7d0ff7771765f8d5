#include "services/keyframer/joint/calibration_watch.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory;
using keyframer::CalibrationError;
using keyframer::joint::CalibrationNumbers;
using keyframer::joint::CalibrationWatch;
using keyframer::joint::TurnDifference;
using keyframer::joint::TwoMotions;
using keyframer::joint::WayDifference;

namespace {

struct Wrong {
  double yaw_rad = 0.0;
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double scale = 0.0;
  double late_s = 0.0;
};

/// Where the vehicle was; the path has a pose for each 0.1 s.
geometry::SE2 pose_at(const std::vector<geometry::SE2>& path, double time_s) {
  const double k = std::max(0.0, 10.0 * time_s);
  const auto before = static_cast<std::size_t>(k);
  if (before + 1 >= path.size()) return path.back();
  const geometry::SE2 step = path[before].inverse() * path[before + 1];
  return path[before] * geometry::SE2::Exp((k - static_cast<double>(before)) * step.Log());
}

/// How a vehicle drives: it winds along at 3 m/s, or straight on at a speed that changes.
geometry::SE2 winding(int k) { return geometry::SE2::Exp({0.3, 0.0, 0.03 * std::sin(0.05 * k)}); }
geometry::SE2 surging(int k) { return {0.3 + 0.15 * std::sin(0.1 * k), 0.0, 0.0}; }

/// Landmarks show its motion over 0.4 s, wheels and gyro that over 0.1 s.
CalibrationError after(double seconds, const Wrong& wrong, std::uint64_t seed,
                       geometry::SE2 (*step_of)(int) = winding) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double sigma_landmarks_m = 0.02;
  const double sigma_landmarks_rad = 0.001;
  const double sigma_wheels_m = 0.004;
  const geometry::SE2 mounting(wrong.place_m, wrong.yaw_rad);

  CalibrationWatch watch;
  const int scans = static_cast<int>(10.0 * seconds);
  std::vector<geometry::SE2> path(1);
  for (int k = 1; k <= scans + 10; ++k) path.push_back(path.back() * step_of(k));
  for (int k = 1; k <= scans; ++k) {
    const geometry::SE2 step = step_of(k);
    model::Odometry increment;
    increment.from_utime = 100'000 * (k - 1);
    increment.utime = 100'000 * k;
    increment.has_wheels = true;
    increment.from_T_to = geometry::SE2(
        (1.0 + wrong.scale) * step.x() + sigma_wheels_m * normal(random),
        step.y() + sigma_wheels_m * normal(random), step.theta() + 1e-4 * normal(random));
    increment.covariance =
        Eigen::Vector3d(sigma_wheels_m * sigma_wheels_m, sigma_wheels_m * sigma_wheels_m, 1e-8)
            .asDiagonal();
    watch.add(increment);
    if (k < 10) continue;

    const geometry::SE2 truth = pose_at(path, 0.1 * (k - 4) - wrong.late_s).inverse() *
                                pose_at(path, 0.1 * k - wrong.late_s);
    const geometry::SE2 noise(sigma_landmarks_m * normal(random),
                              sigma_landmarks_m * normal(random),
                              sigma_landmarks_rad * normal(random));
    model::ScanMotion motion{100'000 * (k - 4), 100'000 * k, {}};
    motion.then_T_now.mean = mounting * truth * mounting.inverse() * noise;
    motion.then_T_now.covariance = Eigen::Vector3d(sigma_landmarks_m * sigma_landmarks_m,
                                                   sigma_landmarks_m * sigma_landmarks_m,
                                                   sigma_landmarks_rad * sigma_landmarks_rad)
                                       .asDiagonal();
    watch.add(motion);
  }
  return watch.error();
}

}  // namespace

TEST_CASE("Where nothing is wrong, errors stay within their sigmas", "[calibration]") {
  double largest_yaw = 0.0;
  double largest_scale = 0.0;
  double largest_late = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const CalibrationError error = after(60.0, {}, seed);
    largest_yaw = std::max(largest_yaw, std::abs(error.yaw_rad) / error.yaw_sigma_rad);
    largest_scale = std::max(largest_scale, std::abs(error.scale) / error.scale_sigma);
    largest_late = std::max(largest_late, std::abs(error.late_s) / error.late_sigma_s);
    CHECK(error.yaw_sigma_rad < 0.004);
    CHECK(error.late_sigma_s < 0.004);
    CHECK(error.scale_sigma < 0.004);
  }
  CHECK(largest_yaw < 4.0);
  CHECK(largest_scale < 4.0);
  CHECK(largest_late < 4.0);
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

TEST_CASE("Scans that are late are told from yaw, place and scale", "[calibration]") {
  const double yaw = 2.0 * std::numbers::pi / 180.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const double late_s : {0.2, 0.02, -0.05}) {
      const CalibrationError late = after(60.0, {.late_s = late_s}, seed);
      CHECK(std::abs(late.late_s - late_s) < 0.1 * std::abs(late_s) + 4.0 * late.late_sigma_s);
      CHECK(std::abs(late.late_s) > 5.0 * late.late_sigma_s);
      CHECK(std::abs(late.yaw_rad) < 4.0 * late.yaw_sigma_rad);
      CHECK(std::abs(late.scale) < 4.0 * late.scale_sigma);
    }
    const CalibrationError all =
        after(60.0, {.yaw_rad = yaw, .place_m = {0.3, 0.0}, .scale = 0.03, .late_s = 0.05}, seed);
    CHECK(std::abs(all.late_s - 0.05) < 0.01);
    CHECK(std::abs(all.yaw_rad - yaw) < 5.0 * all.yaw_sigma_rad);
    CHECK(std::abs(all.scale - 0.03) < 5.0 * all.scale_sigma);
    const CalibrationError wrong =
        after(60.0, {.yaw_rad = yaw, .place_m = {0.3, -0.2}, .scale = 0.03}, seed);
    CHECK(std::abs(wrong.late_s) < 4.0 * wrong.late_sigma_s);
  }
}

TEST_CASE("Straight on, a changing speed shows late scans and a constant one does not",
          "[calibration]") {
  const auto steady = [](int) { return geometry::SE2(0.3, 0.0, 0.0); };
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const CalibrationError late = after(120.0, {.late_s = 0.2}, seed, surging);
    CHECK(late.late_s > 5.0 * late.late_sigma_s);
    CHECK(late.late_s < 0.25);
    const CalibrationError right = after(120.0, {}, seed, surging);
    CHECK(std::abs(right.late_s) < 4.0 * right.late_sigma_s);
    const CalibrationError hidden = after(120.0, {.late_s = 0.2}, seed, +steady);
    CHECK(std::abs(hidden.late_s) < 4.0 * hidden.late_sigma_s);
    CHECK(hidden.late_sigma_s > 0.01);
  }
}

TEST_CASE("In an even curve a wrong sensor is told from wrong wheels, yaw and place alike",
          "[calibration]") {
  const auto circling = [](int) { return geometry::SE2::Exp({0.3, 0.0, 0.02}); };
  const double yaw = 3.0 * std::numbers::pi / 180.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const CalibrationError turned = after(20.0, {.yaw_rad = yaw}, seed, +circling);
    CHECK(turned.sensor_sigmas > 8.0);
    // Neither number is known alone.
    CHECK(std::abs(turned.yaw_rad) < 5.0 * turned.yaw_sigma_rad);
    CHECK(after(20.0, {.place_m = {0.8, 0.0}}, seed, +circling).sensor_sigmas > 8.0);

    CHECK(after(20.0, {}, seed, +circling).sensor_sigmas < 5.0);
    CHECK(after(20.0, {.scale = 0.05}, seed, +circling).sensor_sigmas < 5.0);
    CHECK(after(20.0, {.scale = 0.05}, seed).sensor_sigmas < 5.0);
  }
}

TEST_CASE("What a wrong calibration makes of a motion is its derivative", "[calibration]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const double step = 1e-6;
  for (int trial = 0; trial < 20; ++trial) {
    const geometry::SE2 truth(6.0 * any(random), 2.0 * any(random), any(random));
    TwoMotions right;
    right.then_twist << 3.0 * any(random), any(random), any(random);
    right.now_twist << 3.0 * any(random), any(random), any(random);
    right.seconds = 2.0;
    right.by_landmarks.mean = right.by_odometry.mean = truth;
    const WayDifference way = way_difference(right);
    const TurnDifference turn = turn_difference(right, 1.0);

    for (int i = 0; i < keyframer::joint::kCalibrationNumbers; ++i) {
      const CalibrationNumbers wrong = step * CalibrationNumbers::Unit(i);
      const geometry::SE2 mounting(wrong(1), wrong(2), wrong(0));
      TwoMotions motions = right;
      motions.by_landmarks.mean = mounting * geometry::SE2::Exp(wrong(4) * right.then_twist) *
                                  truth * geometry::SE2::Exp(-wrong(4) * right.now_twist) *
                                  mounting.inverse();
      motions.by_odometry.mean = geometry::SE2((1.0 + wrong(3)) * truth.translation(),
                                               truth.theta() + wrong(5) * right.seconds);
      const Eigen::Vector2d by_way = way_difference(motions).value_m / step;
      CHECK((by_way - way.jacobian.col(i)).norm() < 1e-4);
      CHECK(turn_difference(motions, 1.0).value_rad / step ==
            Approx(turn.jacobian(i)).margin(1e-4));
    }
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
    watch.add(motion);
    watch.check(motion);
    return watch.contradicts();
  };
  for (int k = 1; k < 100; ++k) REQUIRE_FALSE(drive(k, 0.0));
  CHECK(drive(100, -0.3));
  CHECK_FALSE(drive(101, 0.0));
  watch.check(std::nullopt);
  CHECK_FALSE(watch.contradicts());
}

TEST_CASE("A jump of the scans' clock that hides in noise is told for ten seconds",
          "[calibration]") {
  const double scan_m = 0.03;
  const geometry::SE2 step(0.3, 0.0, 0.01);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<geometry::SE2> seen;
  geometry::SE2 world_T_vehicle;
  CalibrationWatch watch;
  const auto drive = [&](double late_s) {
    const auto k = static_cast<model::Utime>(seen.size());
    model::Odometry increment;
    increment.from_utime = 100'000 * (k - 1);
    increment.utime = 100'000 * k;
    increment.has_wheels = true;
    increment.from_T_to = step;
    increment.covariance = Eigen::Vector3d(1e-5, 1e-5, 1e-8).asDiagonal();
    if (k > 0) watch.add(increment);
    if (k > 0) world_T_vehicle = world_T_vehicle * step;

    const geometry::SE2 noise(scan_m * normal(random), scan_m * normal(random), 0.0);
    seen.push_back(world_T_vehicle * geometry::SE2::Exp(-late_s * 10.0 * step.Log()) * noise);
    if (k < 5) return false;
    const auto then = static_cast<std::size_t>(k - 5);
    model::ScanMotion motion{100'000 * (k - 5), 100'000 * k, {}};
    motion.then_T_now.mean = seen[then].inverse() * seen.back();
    motion.then_T_now.covariance =
        2.0 * Eigen::Vector3d(scan_m * scan_m, scan_m * scan_m, 4e-6).asDiagonal().toDenseMatrix();
    watch.add(motion);
    watch.watch(motion.now_utime, motion);
    return watch.contradicts();
  };

  for (int k = 0; k < 300; ++k) REQUIRE_FALSE(drive(0.0));
  int first = -1;
  int count = 0;
  for (int k = 0; k < 150; ++k) {
    if (!drive(0.06)) continue;
    if (first < 0) first = k;
    ++count;
  }
  CHECK(first >= 0);
  CHECK(first < 8);
  CHECK(count >= 100);
  CHECK(count < 120);

  // Also where odometry ends meanwhile.
  const auto now = 100'000 * static_cast<model::Utime>(seen.size());
  REQUIRE_FALSE(watch.contradicts());
  for (int k = 0; k < 10; ++k) drive(0.0);
  REQUIRE(watch.contradicts());
  watch.watch(now + 5'000'000, std::nullopt);
  CHECK(watch.contradicts());
  watch.watch(now + 12'000'000, std::nullopt);
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
