// The stage under gaps, late, repeated and broken messages, and restarts.
#include <cmath>
#include <limits>

#include "services/ekf/state_covariances.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double position_sigma(const model::EkfPose& pose) { return std::sqrt(pose.covariance(0, 0)); }

}  // namespace

TEST_CASE("Velocity and biases are found", "[ekf]") {
  test::Driven run(40.0, short_drive());
  const model::VelocityCorrection correction = *run.go().correction;
  const Eigen::Vector2d truth =
      run.step.world_T_vehicle.rotation().transpose() * run.step.velocity_mps;
  REQUIRE((correction.velocity_mps - truth).norm() < 0.02);
  REQUIRE(std::abs(correction.bias.x() - run.step.bias.x()) < 2.2e-4);
  REQUIRE((correction.bias - run.step.bias).tail<2>().norm() < 0.015);
  Eigen::Matrix<double, 5, 1> error;
  error << truth - correction.velocity_mps, run.step.bias - correction.bias;
  REQUIRE(error.dot(correction.covariance.llt().solve(error)) < 25.0);
}

TEST_CASE("Over a gap uncertainty grows, and lost tracks rejoin their landmarks", "[ekf]") {
  test::Driven run(15.0, short_drive());
  const double before = position_sigma(*run.go().pose);
  const std::size_t known = run.filter.state().landmarks().size();
  // Half a second without odometry and scans; then all tracks have new ids.
  for (int k = 0; k < 5; ++k) run.step = run.drive.next();
  model::TrackedScan blind = test::true_tracks(run.step);
  blind.landmarks.clear();
  const model::EkfPose lost = *run.filter.add(blind).pose;
  REQUIRE(position_sigma(lost) > 3.0 * before);
  REQUIRE(test::nees(lost, run.truth()) < 16.0);
  REQUIRE(run.filter.counters().gaps >= 1);
  const model::TrackId other_ids = 1000000;
  model::EkfPose found = *run.go(other_ids).pose;
  for (int k = 0; k < 10; ++k) found = *run.go(other_ids).pose;
  CAPTURE(position_sigma(lost), position_sigma(found), test::nees(found, run.truth()));
  REQUIRE(run.filter.counters().rejoined > known / 3);
  REQUIRE(position_sigma(found) < 0.5 * position_sigma(lost));
  REQUIRE(test::nees(found, run.truth()) < 16.0);
  REQUIRE(found.reset_counter == 0);
}

TEST_CASE("Too long a gap restarts the filter and counts it", "[ekf]") {
  test::Driven run(10.0, short_drive());
  const model::EkfPose before = *run.go().pose;
  for (int k = 0; k < 150; ++k) run.step = run.drive.next();
  const model::EkfPose after = *run.filter.add(test::true_tracks(run.step)).pose;
  REQUIRE(after.reset_counter == before.reset_counter + 1);
  REQUIRE(position_sigma(after) >= EkfRestartParameters{}.sigma_m);
}

TEST_CASE("Repeated and late messages change nothing", "[ekf]") {
  test::Driven run(8.0, short_drive());
  const model::TrackedScan last = test::true_tracks(run.step);
  const model::Odometry increment = run.step.odometry.back();
  const std::string before = run.filter.save();
  REQUIRE(!run.filter.add(last).pose);
  REQUIRE(!run.filter.add(increment).pose);
  model::TrackedScan late = last;
  late.utime -= 50000;
  REQUIRE(!run.filter.add(late).pose);
  REQUIRE(run.filter.save() == before);
  REQUIRE(run.filter.counters().scans_refused == 2);
  REQUIRE(run.filter.counters().odometry_refused == 1);
}

TEST_CASE("Odometry that runs ahead of a scan waits for it", "[ekf]") {
  test::Driven ahead(5.0, short_drive());
  test::Driven in_step(5.0, short_drive());
  for (int k = 0; k < 10; ++k) {
    in_step.go();
    // One scan late: odometry of the next interval comes first.
    const sim::DriveStep first = ahead.drive.next();
    const sim::DriveStep second = ahead.drive.next();
    for (const model::Odometry& increment : first.odometry) ahead.filter.add(increment);
    for (const model::Odometry& increment : second.odometry) ahead.filter.add(increment);
    ahead.filter.add(test::true_tracks(first));
    ahead.filter.add(test::true_tracks(second));
    in_step.go();
  }
  REQUIRE(ahead.filter.state().position == in_step.filter.state().position);
  REQUIRE(ahead.filter.counters().gaps == 0);
}

TEST_CASE("Without scans poses still come, with growing covariance", "[ekf]") {
  test::Driven run(8.0, short_drive());
  double last = 0.0;
  int poses = 0;
  for (int k = 0; k < 40; ++k) {
    const sim::DriveStep step = run.drive.next();
    for (const model::Odometry& increment : step.odometry) {
      const auto pose = run.filter.add(increment).pose;
      if (!pose) continue;
      ++poses;
      REQUIRE(position_sigma(*pose) > last);
      last = position_sigma(*pose);
    }
  }
  REQUIRE(poses > 30);
}

TEST_CASE("What is not finite is refused and counted", "[ekf]") {
  test::Driven run(8.0, short_drive());
  const sim::DriveStep step = run.drive.next();
  model::Odometry broken = step.odometry.back();
  broken.inertial->velocity_mps.x() = kNaN;
  run.filter.add(broken);
  broken = step.odometry.back();
  broken.covariance(1, 1) = -1.0;
  run.filter.add(broken);
  REQUIRE(run.filter.counters().odometry_refused == 2);
  for (const model::Odometry& increment : step.odometry) run.filter.add(increment);
  model::TrackedScan scan = test::true_tracks(step);
  const auto count = scan.landmarks.size();
  REQUIRE(count > 3);
  scan.landmarks[0].observed.position_m.y() = kNaN;
  scan.landmarks[1].observed.covariance_m2.setZero();
  scan.landmarks[2].track_id = 0;
  const EkfOutput output = run.filter.add(scan);
  REQUIRE(run.filter.counters().landmarks_unusable == 3);
  REQUIRE(output.pose->landmarks_used + output.pose->landmarks_refused <= count - 3);
  REQUIRE(output.pose->covariance.allFinite());
  REQUIRE(output.pose->reset_counter == 0);
}

TEST_CASE("Empty scans are odometry alone", "[ekf]") {
  test::Driven run(8.0, short_drive());
  const double before = position_sigma(*run.go().pose);
  model::EkfPose pose;
  for (int k = 0; k < 30; ++k) {
    run.step = run.drive.next();
    for (const model::Odometry& increment : run.step.odometry) run.filter.add(increment);
    model::TrackedScan scan = test::true_tracks(run.step);
    scan.landmarks.clear();
    pose = *run.filter.add(scan).pose;
  }
  REQUIRE(pose.landmarks_used == 0);
  REQUIRE(position_sigma(pose) > before);
  REQUIRE(test::nees(pose, run.truth()) < 16.0);
}

TEST_CASE("An outlier is refused, a scan at odds with the map restarts in the end", "[ekf]") {
  test::Driven run(8.0, short_drive());
  run.step = run.drive.next();
  for (const model::Odometry& increment : run.step.odometry) run.filter.add(increment);
  model::TrackedScan scan = test::true_tracks(run.step);
  std::size_t known = 0;
  for (std::size_t i = 0; i < scan.landmarks.size(); ++i) {
    for (const auto& landmark : run.filter.state().landmarks()) {
      if (landmark.id == scan.landmarks[i].track_id) known = i;
    }
  }
  scan.landmarks[known].observed.position_m.x() += 3.0;
  REQUIRE(run.filter.add(scan).pose->landmarks_refused >= 1);
  EkfParameters parameters;
  parameters.map.max_refused = 1000;
  test::Driven other(8.0, short_drive(), parameters);
  model::EkfPose pose = *other.go().pose;
  for (int k = 0; k < parameters.restart.after_refused_scans; ++k) {
    other.step = other.drive.next();
    for (const model::Odometry& increment : other.step.odometry) other.filter.add(increment);
    model::TrackedScan shifted = test::true_tracks(other.step);
    for (model::TrackedLandmark& landmark : shifted.landmarks)
      landmark.observed.position_m.y() += 5.0;
    pose = *other.filter.add(shifted).pose;
  }
  REQUIRE(pose.reset_counter == 1);
  REQUIRE(position_sigma(pose) >= parameters.restart.sigma_m);
}

TEST_CASE("A new landmark too near to an old one is refused", "[ekf]") {
  test::Driven run(5.0, short_drive());
  run.step = run.drive.next();
  for (const model::Odometry& increment : run.step.odometry) run.filter.add(increment);
  model::TrackedScan scan = test::true_tracks(run.step);
  const std::size_t before = run.filter.state().landmarks().size();
  model::TrackedLandmark twin = scan.landmarks.front();
  twin.track_id = 77777777;
  twin.observed.position_m.x() += 0.3;
  const std::uint64_t refused = run.filter.counters().landmarks_too_near;
  scan.landmarks.assign({scan.landmarks.front(), twin});
  run.filter.add(scan);
  REQUIRE(run.filter.counters().landmarks_too_near == refused + 1);
  REQUIRE(run.filter.state().landmarks().size() <= before);
}

TEST_CASE("A clock that jumps back starts anew", "[ekf]") {
  test::Driven run(8.0, short_drive());
  model::TrackedScan scan = test::true_tracks(run.step);
  scan.utime -= 3600LL * 1000000;
  const auto output = run.filter.add(scan);
  REQUIRE(output.pose->reset_counter == 1);
  REQUIRE(output.pose->utime == scan.utime);
}

TEST_CASE("An hour costs no more memory than a minute", "[ekf][long]") {
  sim::InertialDriveParameters drive = short_drive();
  drive.range_m = 8.0;  // A few landmarks: an hour in a second.
  test::Driven run(60.0, drive);
  const std::size_t early = run.filter.save().size();
  std::size_t most = 0;
  for (int k = 0; k < 36000; ++k) {
    run.go();
    most = std::max(most, run.filter.state().landmarks().size());
  }
  REQUIRE(most < 20);
  REQUIRE(run.filter.save().size() < 3 * early + 5000);
  REQUIRE(run.filter.counters().removed > 3000);
  REQUIRE(is_sound(run.filter.state()));
  REQUIRE(pose_covariance(run.filter.state()).llt().info() == Eigen::Success);
}

TEST_CASE("A full state makes room by what is out of sight, and never overflows", "[ekf]") {
  EkfParameters parameters;
  parameters.map.max_landmarks = 6;
  sim::InertialDriveParameters drive = short_drive();
  test::Driven run(20.0, drive, parameters);
  REQUIRE(run.filter.state().landmarks().size() <= 6);
  REQUIRE(run.filter.counters().landmarks_too_near > 0);
  CAPTURE(run.filter.counters().rejoined, run.filter.counters().landmarks_refused,
          run.filter.counters().removed);
  const model::EkfPose pose = *run.go().pose;
  REQUIRE(test::nees(pose, run.truth()) < 25.0);
}
