// ATE, RPE and NEES against brute force and samples.
#include "common/geometry/trajectory_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/catch.hpp"

using namespace understory;
using geometry::PosePair;
using geometry::SE2;

namespace {

/// A drive with turns and stops whose estimate drifts.
std::vector<PosePair> drifting_drive(std::uint64_t seed, std::size_t poses) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> step_m(0.0, 4.0);
  std::vector<PosePair> drive{{SE2(3.0, -8.0, 1.0), SE2(50.0, 20.0, -2.0)}};
  while (drive.size() < poses) {
    const bool is_stop = drive.size() % 7 == 3;
    const Eigen::Vector3d motion(is_stop ? 0.0 : step_m(random), 0.0,
                                 is_stop ? 0.0 : 0.1 * normal(random));
    const Eigen::Vector3d noise(0.05 * normal(random), 0.03 * normal(random),
                                0.01 * normal(random));
    drive.push_back(
        {drive.back().estimate * SE2::Exp(motion + noise), drive.back().truth * SE2::Exp(motion)});
  }
  return drive;
}

/// RMS of the positions after the rotation of the estimates by `theta` and the best translation.
double rms_turned_by(const std::vector<PosePair>& poses, double theta) {
  const SE2 turn(0.0, 0.0, theta);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& pose : poses)
    mean += (pose.truth.translation() - turn * pose.estimate.translation()) /
            static_cast<double>(poses.size());
  double squares = 0.0;
  for (const auto& pose : poses)
    squares += (pose.truth.translation() - turn * pose.estimate.translation() - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(poses.size()));
}

/// All rotations in steps, then smaller steps around the best one.
double searched_rms(const std::vector<PosePair>& poses) {
  double best_theta = 0.0;
  double best = rms_turned_by(poses, best_theta);
  for (double step = 0.01; step > 1e-10; step *= 0.1) {
    const double centre = best_theta;
    const int steps = step == 0.01 ? 315 : 20;
    for (int i = -steps; i <= steps; ++i) {
      const double rms = rms_turned_by(poses, centre + i * step);
      if (rms < best) {
        best = rms;
        best_theta = centre + i * step;
      }
    }
  }
  return best;
}

/// Of pairs by comparing each pose with every later one.
std::vector<std::pair<std::size_t, std::size_t>> all_pairs(const std::vector<PosePair>& poses,
                                                           double length_m) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double path_m = 0.0;
    double least_m = 0.1 * length_m;
    std::size_t best = i;
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      path_m += (poses[j].truth.translation() - poses[j - 1].truth.translation()).norm();
      if (std::abs(path_m - length_m) >= least_m) continue;
      least_m = std::abs(path_m - length_m);
      best = j;
    }
    if (best != i && poses[i].map_id == poses[best].map_id) pairs.emplace_back(i, best);
  }
  return pairs;
}

/// A random covariance with sigmas of centimetres and milliradians.
Eigen::Matrix3d random_covariance(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix3d root;
  for (int i = 0; i < 9; ++i) root(i) = 0.02 * normal(random);
  return root * root.transpose() + 1e-5 * Eigen::Matrix3d::Identity();
}

}  // namespace

TEST_CASE("ATE is the least that any rotation and translation leave", "[geometry]") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto drive = drifting_drive(seed, 20 + 10 * seed);
    const auto error = geometry::aligned_error(drive);
    REQUIRE(error);
    CHECK(error->rms_m == Approx(searched_rms(drive)).epsilon(1e-9));
    CHECK(error->largest_m >= error->rms_m);
  }
}

TEST_CASE("ATE does not depend on the frame of the estimate", "[geometry]") {
  auto drive = drifting_drive(3, 100);
  const auto before = geometry::aligned_error(drive);
  for (auto& pose : drive) pose.estimate = SE2(-700.0, 90.0, 2.5) * pose.estimate;
  const auto after = geometry::aligned_error(drive);
  REQUIRE((before && after));
  CHECK(after->rms_m == Approx(before->rms_m).epsilon(1e-9));
  CHECK(after->largest_m == Approx(before->largest_m).epsilon(1e-9));

  for (auto& pose : drive) pose.estimate = SE2(1.0, 2.0, 3.0) * pose.truth;
  CHECK(geometry::aligned_error(drive)->largest_m < 1e-9);
  drive.resize(2);
  CHECK_FALSE(geometry::aligned_error(drive));
}

TEST_CASE("RPE is that of every pair compared one by one", "[geometry]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    auto drive = drifting_drive(seed, 300);
    if (seed % 3 == 0) {
      for (std::size_t i = 150; i < drive.size(); ++i) drive[i].map_id = 2;
    }
    for (const double length_m : {3.0, 10.0, 100.0, 250.0}) {
      CAPTURE(seed, length_m);
      const auto pairs = all_pairs(drive, length_m);
      double squares = 0.0;
      double angles = 0.0;
      for (const auto& [i, j] : pairs) {
        const Eigen::Matrix2d turn = drive[i].truth.rotation().transpose();
        const Eigen::Vector2d true_m =
            turn * (drive[j].truth.translation() - drive[i].truth.translation());
        const Eigen::Vector2d estimated_m =
            drive[i].estimate.rotation().transpose() *
            (drive[j].estimate.translation() - drive[i].estimate.translation());
        squares += (estimated_m - true_m).squaredNorm();
        const double angle = (drive[j].estimate.theta() - drive[i].estimate.theta()) -
                             (drive[j].truth.theta() - drive[i].truth.theta());
        angles += std::pow(std::remainder(angle, 2.0 * std::numbers::pi), 2);
      }
      const auto error = geometry::relative_error(drive, length_m);
      REQUIRE(error.has_value() == !pairs.empty());
      if (!error) continue;
      const auto count = static_cast<double>(pairs.size());
      CHECK(error->pairs == pairs.size());
      CHECK(error->translation_rms_m == Approx(std::sqrt(squares / count)));
      CHECK(error->rotation_rms_deg ==
            Approx(180.0 / std::numbers::pi * std::sqrt(angles / count)));
    }
  }
}

TEST_CASE("RPE of a scale and of a turning rate are what they are for each metre", "[geometry]") {
  std::vector<PosePair> drive;
  for (int i = 0; i <= 300; ++i) {
    const double path_m = 0.5 * i;
    drive.push_back({SE2::Exp({1.02 * path_m, 0.0, 0.0}), SE2::Exp({path_m, 0.0, 0.0})});
  }
  for (const double length_m : {10.0, 100.0}) {
    const auto error = geometry::relative_error(drive, length_m);
    REQUIRE(error);
    CHECK(error->pairs == 301 - static_cast<std::size_t>(2.0 * 0.9 * length_m));
    // Pairs at the end are up to a tenth shorter.
    CHECK(error->translation_mean_percent == Approx(2.0));
    CHECK(error->translation_rms_m == Approx(0.02 * length_m).epsilon(0.03));
    CHECK(error->rotation_mean_deg_per_m == Approx(0.0).margin(1e-12));
  }
  CHECK_FALSE(geometry::relative_error(drive, 1000.0));

  for (auto& pose : drive) pose.estimate = SE2::Exp(pose.truth.x() * Eigen::Vector3d(1, 0, 0.001));
  CHECK(geometry::relative_error(drive, 100.0)->rotation_mean_deg_per_m ==
        Approx(0.001 * 180.0 / std::numbers::pi));
}

TEST_CASE("RPE has no number where the poses are too far apart or do not move", "[geometry]") {
  std::vector<PosePair> sparse;
  for (int i = 0; i < 50; ++i) sparse.push_back({SE2(8.0 * i, 0, 0), SE2(8.0 * i, 0, 0)});
  CHECK_FALSE(geometry::relative_error(sparse, 10.0));  // 8 m and 16 m: neither is within 9 to 11.
  CHECK(geometry::relative_error(sparse, 100.0));
  CHECK_FALSE(geometry::relative_error(std::vector<PosePair>(50), 10.0));
  CHECK_FALSE(geometry::relative_error({}, 10.0));
}

TEST_CASE("NEES of samples of a covariance is chi-squared of three degrees", "[geometry]") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 4; ++round) {
    const Eigen::Matrix3d covariance = random_covariance(random);
    const Eigen::Matrix3d root = covariance.llt().matrixL();
    std::vector<double> stated_well;
    std::vector<double> stated_half;
    for (int i = 0; i < 20'000; ++i) {
      const Eigen::Vector3d error =
          root * Eigen::Vector3d(normal(random), normal(random), normal(random));
      const SE2 estimate(100.0 * normal(random), 100.0 * normal(random), 3.0 * normal(random));
      const PosePair pose{estimate, estimate * SE2::Exp(error)};
      stated_well.push_back(*geometry::nees(pose, covariance));
      stated_half.push_back(*geometry::nees(pose, 0.25 * covariance));
    }

    const auto well = geometry::summary_of(stated_well);
    REQUIRE(well);
    CHECK(well->count == 20'000);
    CHECK(well->mean == Approx(3.0).margin(0.08));
    CHECK(well->median == Approx(2.366).margin(0.07));
    CHECK(well->share_in_band == Approx(0.95).margin(0.008));
    CHECK(well->share_above == Approx(0.025).margin(0.006));
    const auto half = geometry::summary_of(stated_half);
    CHECK(half->mean == Approx(4.0 * well->mean));
    CHECK(half->share_above > 0.4);
  }
}

TEST_CASE("NEES has no number where a covariance states nothing", "[geometry]") {
  const PosePair pose{SE2(), SE2(0.1, 0.0, 0.0)};
  CHECK_FALSE(geometry::nees(pose, Eigen::Matrix3d::Zero()));
  CHECK_FALSE(geometry::nees(pose, Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal()));
  CHECK_FALSE(geometry::nees(pose, Eigen::Matrix3d::Constant(NAN)));
  CHECK_FALSE(geometry::nees(pose, INFINITY * Eigen::Matrix3d::Identity()));
  CHECK(*geometry::nees(pose, 0.01 * Eigen::Matrix3d::Identity()) == Approx(1.0));
  CHECK_FALSE(geometry::summary_of({}));
  CHECK(geometry::summary_of({4.0})->median == 4.0);
  CHECK(geometry::summary_of({9.0, 1.0, 2.0, 100.0})->median == 5.5);
}
