// The filter after an interval of which it knows nothing: its own pause, or that of who feeds it.
#include <cmath>
#include <random>

#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// Squared distance that three Gaussian errors exceed in 0.27 % of the cases, as one does 3 sigma.
constexpr double kThreeSigma = 14.16;
/// Seeds 1 to 19 were tuned on.
constexpr std::uint64_t kFirstSeed = 101;

struct Gap {
  double seconds = 1.1;
  bool keeps_tracks = true;  ///< False: who follows the tracks has lost them, too.
  bool has_wheels = true;
};

struct AfterGap {
  double step_m = 0.0;    ///< By how much the position's error changes over the gap.
  double nees = 0.0;      ///< Of the first pose.
  double rms_m = 0.0;     ///< During five seconds after it, from the first pose where it restarted.
  double before_m = 0.0;  ///< The same before the gap.
  std::uint64_t resets = 0;
};

/// Error of a pose in the map [m].
Eigen::Vector2d error_of(const model::EkfPose& pose, const geometry::SE2& truth) {
  return pose.ekf_map_T_vehicle.translation() - truth.translation();
}

/// Dead reckoning beside a drive: truth with errors that add up and that it states.
class Reckoning {
 public:
  Reckoning(const Driven& run, std::uint64_t seed)
      : random_(seed), world_T_vehicle_(run.step.world_T_vehicle) {}

  model::RawPose go_to(const sim::DriveStep& step) {
    const geometry::SE2 moved = world_T_vehicle_.inverse() * step.world_T_vehicle;
    world_T_vehicle_ = step.world_T_vehicle;
    const Eigen::Vector3d sigma(0.01, 0.01, 0.001);
    const Eigen::Vector3d noise(normal_(random_), normal_(random_), normal_(random_));
    const geometry::SE2 measured = moved * geometry::SE2::Exp(sigma.cwiseProduct(noise));
    reckoned_ = geometry::compound(reckoned_, {measured, sigma.cwiseAbs2().asDiagonal()});

    model::RawPose pose;
    pose.utime = step.scan.utime;
    pose.odom_T_vehicle = reckoned_.mean;
    pose.covariance = reckoned_.covariance;
    return pose;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  geometry::SE2 world_T_vehicle_;
  geometry::SE2WithCovariance reckoned_{{3.0, -2.0, 0.4}, Eigen::Matrix3d::Zero()};
};

AfterGap drive_over(const Gap& gap, std::uint64_t seed) {
  sim::InertialDriveParameters parameters = short_drive();
  parameters.range_m = 25.0;
  if (gap.has_wheels) parameters.odometry = sim::OdometryKind::kInertialAndWheels;
  test::Driven run(10.0, parameters, {}, seed);

  AfterGap after;
  model::EkfPose pose;
  for (int k = 0; k < 50; ++k) {
    pose = *run.go().pose;
    after.before_m += error_of(pose, run.truth()).squaredNorm() / 50.0;
  }
  const Eigen::Vector2d before = error_of(pose, run.truth());
  const std::uint64_t resets = pose.reset_counter;

  for (int k = 0; k < static_cast<int>(10.0 * gap.seconds); ++k) run.step = run.drive.next();
  const model::TrackId ids = gap.keeps_tracks ? 1 : 1'000'000;
  pose = *run.go(ids).pose;
  after.step_m = (error_of(pose, run.truth()) - before).norm();
  after.nees = test::nees(pose, run.truth());

  // What follows, from the first pose on.
  const geometry::SE2 truth_T_map = run.truth() * pose.ekf_map_T_vehicle.inverse();
  for (int k = 0; k < 50; ++k) {
    pose = *run.go(ids).pose;
    const bool is_new_map = gap.seconds > 10.0;
    const geometry::SE2 at =
        is_new_map ? truth_T_map * pose.ekf_map_T_vehicle : pose.ekf_map_T_vehicle;
    after.rms_m += (at.translation() - run.truth().translation()).squaredNorm() / 50.0;
  }
  after.resets = pose.reset_counter - resets;
  after.rms_m = std::sqrt(after.rms_m);
  after.before_m = std::sqrt(after.before_m);
  return after;
}

}  // namespace

TEST_CASE("After a gap of about a second the pose goes on without a step", "[ekf][gap]") {
  double worst = 0.0;
  double before = 0.0;
  double rms = 0.0;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 20; ++seed) {
    for (const double seconds : {0.3, 0.6, 1.1}) {
      const AfterGap after = drive_over({seconds, seed % 2 == 0, seed % 3 != 0}, seed);
      CAPTURE(seed, seconds, after.step_m, after.rms_m, after.before_m, after.nees);
      CHECK(after.step_m < 0.10);
      CHECK(after.resets == 0);
      worst = std::max(worst, after.step_m);
      before += after.before_m;
      rms += after.rms_m;
    }
  }
  WARN("largest step " << worst << " m, rms after/before " << rms / before);
  CHECK(rms < 1.5 * before + 60 * 0.02);
}

TEST_CASE("After a long gap the pose is as uncertain as it says, and says so", "[ekf][gap]") {
  int trials = 0;
  int within = 0;
  double worst = 0.0;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 20; ++seed) {
    for (const double seconds : {3.0, 6.0, 30.0}) {
      const AfterGap after = drive_over({seconds, seed % 2 == 0, seed % 3 != 0}, seed);
      CAPTURE(seed, seconds, after.step_m, after.rms_m, after.before_m, after.nees, after.resets);
      CHECK(after.resets >= 1);
      ++trials;
      within += after.nees < kThreeSigma;
      worst = std::max(worst, after.nees);
      CHECKED_ELSE(after.nees < kThreeSigma) { WARN("not within: " << seed << " " << seconds); }
    }
  }
  WARN(within << " of " << trials << " within 3 sigma, worst NEES " << worst);
  CHECK(within >= 0.99 * trials);
}

TEST_CASE("Over a gap in which dead reckoning goes on the filter keeps its place", "[ekf][gap]") {
  double worst_nees = 0.0;
  double sum_nees = 0.0;
  int trials = 0;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 20; ++seed) {
    for (const double gap_s : {1.1, 3.0, 6.0, 30.0}) {
      sim::InertialDriveParameters parameters = short_drive();
      parameters.range_m = 25.0;
      if (seed % 3 != 0) parameters.odometry = sim::OdometryKind::kInertialAndWheels;
      Driven run(10.0, parameters, {}, seed);
      Reckoning reckoning(run, seed);
      const auto go = [&](model::TrackId ids) {
        run.step = run.drive.next();
        run.filter.add(reckoning.go_to(run.step));
        for (const model::Odometry& increment : run.step.odometry) run.filter.add(increment);
        return *run.filter.add(true_tracks(run.step, ids)).pose;
      };
      for (int k = 0; k < 20; ++k) go(1);
      const std::uint64_t resets = go(1).reset_counter;

      for (int k = 0; k < static_cast<int>(10.0 * gap_s); ++k) {
        run.step = run.drive.next();
        reckoning.go_to(run.step);
      }
      // Its first pose after the gap is beside the odometry that begins there.
      run.filter.add(reckoning.go_to(run.step = run.drive.next()));
      const model::EkfPose pose = go(seed % 2 == 0 ? 1 : 1'000'000);
      const double nees = test::nees(pose, run.truth());
      const double error_m = error_of(pose, run.truth()).norm();
      CAPTURE(seed, gap_s, nees, error_m, pose.covariance);
      CHECK(error_m < (gap_s > 10.0 ? 5.0 : 0.5));
      CHECK(pose.reset_counter - resets == (gap_s > 1.5 ? 1 : 0));
      worst_nees = std::max(worst_nees, nees);
      sum_nees += nees;
      ++trials;
    }
  }
  WARN("mean NEES " << sum_nees / trials << ", worst " << worst_nees);
  CHECK(worst_nees < kThreeSigma);
  CHECK(sum_nees / trials < 3.5);
}
