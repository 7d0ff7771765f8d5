// How well sweeps are levelled, and what a pose has of it.
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "common/model/level.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::model;

namespace {

Odometry increment(Utime utime, std::optional<double> level_sigma_rad) {
  Odometry odometry;
  odometry.from_utime = utime - 100'000;
  odometry.utime = utime;
  if (level_sigma_rad) {
    odometry.inertial.emplace();
    odometry.inertial->level.covariance =
        *level_sigma_rad * *level_sigma_rad * Eigen::Matrix2d::Identity();
  }
  return odometry;
}

}  // namespace

TEST_CASE("A level that is measured adds nothing to a pose", "[level]") {
  SweepLevel level;
  CHECK(level.pose_covariance().isZero());
  // Never measured: nobody knows what is usual.
  level.add(increment(100'000, std::nullopt));
  CHECK(level.pose_covariance().isZero());
  // It becomes known in the first seconds, and less well in a standstill.
  Utime utime = 200'000;
  for (const double sigma : {0.1, 0.03, 0.01, 0.003, 0.001, 0.0015, 0.003}) {
    level.add(increment(utime += 100'000, sigma));
    CHECK(level.pose_covariance().isZero());
  }
}

TEST_CASE("A level that nobody measures any more grows, and ends when it is known", "[level]") {
  SweepLevel level;
  level.add(increment(100'000, 0.001));
  Utime utime = 100'000;
  double last = 0.0;
  for (int k = 0; k < 30; ++k) {
    level.add(increment(utime += 100'000, std::nullopt));
    const double now = level.pose_covariance()(0, 0);
    CHECK(now >= last);
    last = now;
  }
  // Three seconds at 30 mrad per square root of a second, at breast height.
  CHECK(std::sqrt(last) > 0.06);
  CHECK(std::sqrt(last) < 0.075);
  level.add(increment(utime += 100'000, 0.02));
  CHECK(level.pose_covariance()(0, 0) > 0.0);
  level.add(increment(utime += 100'000, 0.002));
  CHECK(level.pose_covariance().isZero());
}

TEST_CASE("The pose among landmarks that a tilt displaces is as far off as stated", "[level]") {
  // Landmarks all around; the error rolls and pitches, and changes within the revolution.
  SweepLevel level;
  level.add(increment(100'000, 0.001));
  for (Utime utime = 200'000; utime < 20'000'000; utime += 100'000)
    level.add(increment(utime, std::nullopt));
  const Eigen::Matrix3d stated = level.pose_covariance();

  std::mt19937_64 random(5);
  std::normal_distribution<double> tilt(0.0, kMostTiltOfPoses_rad);
  double mean_square_m2 = 0.0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector2d error_rad(tilt(random), tilt(random));
    // Displaced by height times (pitch, -roll), each landmark alike: so is the pose.
    const Eigen::Vector2d moved_m(1.3 * error_rad.y(), -1.3 * error_rad.x());
    mean_square_m2 += moved_m.squaredNorm() / kTrials;
  }
  CHECK(stated.topLeftCorner<2, 2>().trace() == Approx(mean_square_m2).epsilon(0.08));
  CHECK(stated(2, 2) > 0.0);
  CHECK(stated.determinant() > 0.0);
}
