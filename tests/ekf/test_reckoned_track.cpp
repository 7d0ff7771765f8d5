// What dead reckoning says of an interval: against the truth, and where it must say nothing.
#include <Eigen/Cholesky>
#include <random>

#include "services/ekf/reckoned_track.hpp"
#include "tests/catch.hpp"

using namespace understory;
using ekf::ReckonedTrack;

namespace {

constexpr model::Utime kStep_us = 20'000;
const geometry::SE2 kStepMotion = geometry::SE2::Exp({0.1, 0.0, 0.004});

/// A track that turns, 50 poses a second, with what it states of its errors.
struct Track {
  geometry::SE2WithCovariance odom_T_vehicle;
  model::Utime utime = 1'000'000;

  model::RawPose go(const Eigen::Vector3d& sigma = {0.002, 0.002, 0.0002},
                    const Eigen::Vector3d& error = Eigen::Vector3d::Zero()) {
    odom_T_vehicle = geometry::compound(
        odom_T_vehicle, {kStepMotion * geometry::SE2::Exp(error), sigma.cwiseAbs2().asDiagonal()});
    utime += kStep_us;
    model::RawPose pose;
    pose.utime = utime;
    pose.odom_T_vehicle = odom_T_vehicle.mean;
    pose.covariance = odom_T_vehicle.covariance;
    return pose;
  }
};

void feed(ReckonedTrack& reckoned, Track& track, int poses) {
  for (int i = 0; i < poses; ++i) reckoned.add(track.go());
}

}  // namespace

TEST_CASE("The motion over a gap is what dead reckoning did, between its poses too", "[ekf]") {
  Track track;
  ReckonedTrack reckoned;
  feed(reckoned, track, 20);
  const model::Utime from = track.utime - 30'000;
  for (int i = 0; i < 300; ++i) track.go();  // Not heard.
  feed(reckoned, track, 5);
  const model::Utime to = track.utime - 4 * kStep_us - 15'000;  // Before the first one heard.

  const auto motion = reckoned.between(from, to);
  REQUIRE(motion);
  const double steps = static_cast<double>(to - from) / kStep_us;
  const geometry::SE2 truth = geometry::SE2::Exp(steps * kStepMotion.Log());
  CHECK((truth.inverse() * motion->from_T_to.mean).Log().norm() < 1e-9);
  CHECK((motion->velocity_mps - 50.0 * kStepMotion.Log().head<2>()).norm() < 1e-6);
}

TEST_CASE("Its covariance is that of the motion alone, by many drives", "[ekf]") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sigma(0.01, 0.02, 0.003);
  const auto go = [&](Track& track) {
    const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
    return track.go(sigma, sigma.cwiseProduct(noise));
  };

  double sum = 0.0;
  constexpr int kDrives = 400;
  for (int drive = 0; drive < kDrives; ++drive) {
    Track track;
    ReckonedTrack reckoned;
    for (int i = 0; i < 100; ++i) reckoned.add(go(track));
    const model::Utime from = track.utime;
    for (int i = 0; i < 100; ++i) go(track);
    const model::Utime to = track.utime;
    for (int i = 0; i < 2; ++i) reckoned.add(track.go(Eigen::Vector3d::Constant(1e-6)));

    const auto motion = reckoned.between(from, to);
    REQUIRE(motion);
    const geometry::SE2 truth = geometry::SE2::Exp(100.0 * kStepMotion.Log());
    const Eigen::Vector3d error = (motion->from_T_to.mean.inverse() * truth).Log();
    // Without the hundredth of the displacement that is added for what lasts.
    Eigen::Matrix3d covariance = motion->from_T_to.covariance;
    covariance.topLeftCorner<2, 2>().diagonal().array() -=
        1e-4 * motion->from_T_to.mean.translation().squaredNorm();
    sum += error.dot(covariance.llt().solve(error));
  }
  // Chi-squared of three degrees of freedom: 3, its mean of 400 to 0.12.
  CHECK(sum / kDrives == Approx(3.0).margin(0.5));
}

TEST_CASE("It says nothing where it does not know", "[ekf]") {
  Track track;
  ReckonedTrack reckoned;
  CHECK_FALSE(reckoned.between(0, 1'000'000));
  feed(reckoned, track, 20);
  const model::Utime from = track.utime;
  CHECK_FALSE(reckoned.between(from, from + 5'000'000));  // Nothing came since.

  SECTION("dead reckoning had a gap of its own") { track.go({3.0, 3.0, 0.6}); }
  SECTION("dead reckoning began anew") {
    track.odom_T_vehicle = {};
    track.utime += 3'000'000;
  }
  feed(reckoned, track, 5);
  CHECK_FALSE(reckoned.between(from, track.utime));
}

TEST_CASE("What is no dead reckoning is left out", "[ekf]") {
  Track track;
  ReckonedTrack reckoned;
  feed(reckoned, track, 20);
  const model::Utime from = track.utime;
  model::RawPose pose = track.go();
  pose.is_reference = true;
  reckoned.add(pose);
  pose = track.go();
  pose.covariance(0, 0) = std::nan("");
  reckoned.add(pose);
  CHECK_FALSE(reckoned.between(from, track.utime + 60'000));

  // A clock that jumped back: another track.
  track.utime = 0;
  feed(reckoned, track, 5);
  CHECK_FALSE(reckoned.between(from, track.utime));
  CHECK(reckoned.between(track.utime - 2 * kStep_us, track.utime));
}
