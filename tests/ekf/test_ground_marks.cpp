// A stationary vehicle: its pose is kept for hours, and creeping is found.
#include "services/ekf/ground_marks.hpp"

#include <cmath>

#include "services/ekf/prediction.hpp"
#include "services/ekf/state_covariances.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

constexpr Sway kSway{2e-3, 5e-4};
constexpr double kGate = 30.0;

/// An increment of an IMU that measures no motion, with the noise of the simulated one.
model::Odometry stationary_increment(model::Utime from, model::Utime to) {
  model::Odometry increment;
  increment.from_utime = from;
  increment.utime = to;
  increment.is_stationary = true;
  model::Preintegration& inertial = increment.inertial.emplace();
  inertial.seconds = 1e-6 * static_cast<double>(to - from);
  const double s = inertial.seconds;
  const double q = 2.5e-5;
  inertial.covariance(0, 0) = 4e-8 * s;
  for (int k = 1; k <= 2; ++k) {
    inertial.covariance(k, k) = q * s;
    inertial.covariance(k, k + 2) = inertial.covariance(k + 2, k) = 0.5 * q * s * s;
    inertial.covariance(k + 2, k + 2) = q * s * s * s / 3.0;
    inertial.bias_jacobian(k, k) = -s;
    inertial.bias_jacobian(k + 2, k) = -0.5 * s * s;
  }
  inertial.bias_jacobian(0, 0) = -s;
  return increment;
}

}  // namespace

TEST_CASE("Marks set from a pose add no information about that pose", "[ekf][stationary]") {
  std::mt19937_64 random(21);
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 3, random);
    LowRank low_rank(state.size() + 4);
    JointUpdate joint(5);
    const Eigen::MatrixXd before = full_covariance(state);
    const geometry::SE2 pose = vehicle_pose(state);
    add_ground_marks(state, kSway);
    REQUIRE(has_ground_marks(state));
    REQUIRE(measure_ground_marks(state, kSway, kGate, joint, low_rank));
    remove_ground_marks(state);
    REQUIRE(!has_ground_marks(state));
    REQUIRE(state.landmarks().size() == 3);
    REQUIRE((full_covariance(state) - before).norm() < 1e-9 * before.norm());
    REQUIRE((pose.inverse() * vehicle_pose(state)).Log().norm() < 1e-9);
  }
}

TEST_CASE("Marks keep the pose, but for twice the sway, over unknown motion", "[ekf][stationary]") {
  std::mt19937_64 random(22);
  for (const ErrorForm form : test::kForms) {
    FilterState state(form, 2);
    state.heading = test::normal(random);
    state.position = 20.0 * Eigen::Vector2d(test::normal(random), test::normal(random));
    state.first_position = state.position;
    set_pose_covariance(state, Eigen::Vector3d(1e-4, 2e-4, 1e-6).asDiagonal());
    LowRank low_rank(state.size() + 4);
    JointUpdate joint(2);
    const Eigen::Matrix3d before = pose_covariance(state);
    add_ground_marks(state, kSway);
    EkfMotionParameters motion;
    motion.gap_acceleration = 100.0;
    motion.gap_yaw_rate = 0.5;
    predict(state, transition_over_gap(state, 0.2, motion), motion, low_rank);
    REQUIRE(pose_covariance(state)(2, 2) > before(2, 2) + 0.009);
    REQUIRE(measure_ground_marks(state, kSway, kGate, joint, low_rank));
    const Eigen::Matrix3d grown = pose_covariance(state) - before;
    // Twice: when the marks were set, and now.
    const Eigen::Vector3d expected =
        2.0 * Eigen::Vector3d(kSway.sigma_m, kSway.sigma_m, kSway.sigma_rad).cwiseAbs2();
    CAPTURE(static_cast<int>(form), grown.diagonal().transpose(), expected.transpose());
    REQUIRE((grown.diagonal() - expected).cwiseAbs().maxCoeff() < 0.02 * expected.x());
  }
}

TEST_CASE("A vehicle that has moved off its marks is found, and the state is not changed",
          "[ekf][stationary]") {
  FilterState state(ErrorForm::kRightInvariant, 2);
  LowRank low_rank(state.size() + 4);
  JointUpdate joint(2);
  set_pose_covariance(state, 1e-8 * Eigen::Matrix3d::Identity());
  add_ground_marks(state, kSway);
  state.position.x() += 20.0 * kSway.sigma_m;
  const Eigen::MatrixXd before = full_covariance(state);
  const geometry::SE2 pose = vehicle_pose(state);
  REQUIRE(!measure_ground_marks(state, kSway, kGate, joint, low_rank));
  REQUIRE(full_covariance(state) == before);
  REQUIRE(vehicle_pose(state).coordinates() == pose.coordinates());
}

TEST_CASE("The covariance of a vehicle that is stationary for hours does not grow",
          "[ekf][stationary]") {
  Ekf filter((EkfParameters()));
  model::EkfPose pose;
  const auto wait = [&](int increments) {
    for (int k = 0; k < increments; ++k) {
      const model::Utime from = filter.utime();
      filter.add(stationary_increment(from, from + 100000));
      model::TrackedScan scan;
      scan.utime = from + 100000;
      const EkfOutput output = filter.add(scan);
      REQUIRE(output.map->landmarks.empty());
      pose = *output.pose;
    }
  };
  wait(50);
  const Eigen::Matrix3d early = pose.covariance;
  wait(50000);
  const EkfMotionParameters motion;
  REQUIRE(pose.covariance(0, 0) <= 1.01 * early(0, 0));
  REQUIRE(pose.covariance(2, 2) <= 1.01 * early(2, 2));
  REQUIRE(std::sqrt(pose.covariance(0, 0)) > 0.9 * motion.stationary_sigma_m);
  REQUIRE(std::sqrt(pose.covariance(2, 2)) > 0.9 * motion.stationary_sigma_rad);
  REQUIRE(filter.counters().crept == 0);
  // Marks go with the motion.
  REQUIRE(has_ground_marks(filter.state()));
  model::Odometry away = stationary_increment(filter.utime(), filter.utime() + 100000);
  away.is_stationary = false;
  model::TrackedScan scan;
  scan.utime = away.utime;
  filter.add(away);
  filter.add(scan);
  REQUIRE(!has_ground_marks(filter.state()));
}

TEST_CASE("Landmarks overrule a detector that takes creeping for stationary", "[ekf][stationary]") {
  Ekf filter((EkfParameters()));
  std::mt19937_64 random(23);
  constexpr double kCreep_m = 1e-3;  // per increment: 1 cm/s
  geometry::SE2 truth;
  model::EkfPose pose;
  double worst_m = 0.0;
  for (int k = 0; k <= 300; ++k) {
    if (k > 100) truth = truth * geometry::SE2(kCreep_m, 0.0, 0.0);
    model::TrackedScan scan;
    scan.utime = 100000 * k;
    scan.field_of_view.max_range_m = 40.0;
    if (k > 0) filter.add(stationary_increment(scan.utime - 100000, scan.utime));
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector2d place = 15.0 * geometry::SE2(0.0, 0.0, 0.5 * i).rotation().col(0);
      model::Detection seen;
      seen.position_m.head<2>() =
          truth.inverse() * place +
          0.01 * Eigen::Vector2d(test::normal(random), test::normal(random));
      seen.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
      scan.landmarks.push_back(
          {static_cast<model::TrackId>(i + 1), static_cast<std::uint32_t>(i), seen});
    }
    pose = *filter.add(scan).pose;
    worst_m = std::max(worst_m, (truth.inverse() * pose.ekf_map_T_vehicle).translation().norm());
  }
  const Eigen::Vector3d error = (truth.inverse() * pose.ekf_map_T_vehicle).coordinates();
  CAPTURE(worst_m, error.transpose(), filter.counters().crept, filter.counters().restarts);
  REQUIRE(filter.counters().crept > 0);
  REQUIRE(filter.counters().restarts == 0);
  REQUIRE(worst_m < 0.026);
  REQUIRE(error.head<2>().norm() < 0.007);
  REQUIRE(nees(pose, truth) < 25.0);
}

TEST_CASE("The pose of a swaying vehicle is consistent", "[ekf][stationary][consistency]") {
  sim::InertialDriveParameters drive = short_drive();
  drive.stationary_s = 12.0;
  drive.sway_sigma_m = EkfMotionParameters{}.stationary_sigma_m;
  drive.sway_sigma_rad = EkfMotionParameters{}.stationary_sigma_rad;
  drive.sway_sigma_mps = EkfMotionParameters{}.stationary_sigma_mps;
  double mean = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    mean +=
        test::drive_through(drive, {}, 11.0, 300 + static_cast<unsigned>(run)).last_nees / kRuns;
  }
  // 99.9 % band of a 40-run mean.
  REQUIRE(mean > 1.9);
  REQUIRE(mean < 4.4);
}

TEST_CASE("A full state has room for the ground marks", "[ekf][stationary]") {
  EkfParameters parameters;
  parameters.map.max_landmarks = 4;
  sim::InertialDriveParameters drive = short_drive();
  drive.stationary_s = 5.0;
  sim::InertialDrive steps(drive, test::trunks(), 5);
  Ekf filter(parameters);
  for (int k = 0; k < 60; ++k) {
    const sim::DriveStep step = steps.next();
    for (const model::Odometry& increment : step.odometry) filter.add(increment);
    REQUIRE(filter.add(test::true_tracks(step)).map->landmarks.size() <= 4);
    if (k == 40) {
      REQUIRE(filter.state().landmarks().size() == 4 + kGroundMarks);
      Ekf second(parameters);
      second.load(filter.save());
      REQUIRE(second.save() == filter.save());
    }
  }
  REQUIRE(filter.counters().restarts == 0);
}

TEST_CASE("A stationary flag is believed against the filter's own velocity after 10 s only",
          "[ekf][stationary]") {
  test::Driven run(20.0, short_drive());
  const double speed = run.step.velocity_mps.norm();
  REQUIRE(speed > 3.0);
  // The detector takes a smooth road for a stationary vehicle.
  model::EkfPose pose;
  for (int k = 0; k < 150; ++k) pose = *run.go(1, true).pose;
  CAPTURE(pose.velocity_mps.transpose(), nees(pose, run.truth()));
  REQUIRE(pose.velocity_mps.norm() > 3.0);
  REQUIRE(nees(pose, run.truth()) < 16.0);
  REQUIRE(pose.reset_counter == 0);
  REQUIRE(run.filter.counters().crept == 1);
  // No landmark shows motion any more, and the detector keeps its report.
  model::Utime utime = run.filter.utime();
  for (int k = 0; k < 110; ++k, utime += 100000) {
    run.filter.add(stationary_increment(utime, utime + 100000));
    model::TrackedScan scan;
    scan.utime = utime + 100000;
    pose = *run.filter.add(scan).pose;
  }
  REQUIRE(pose.velocity_mps.norm() < 0.01);
}
