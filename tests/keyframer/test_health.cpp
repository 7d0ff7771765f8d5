// What HEALTH says of the keyframer, by faults of its input.
#include <set>
#include <string>
#include <utility>

#include "services/keyframer/health_watch.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer;

namespace {

sim::Drive forest_drive(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.length_m = 60.0;
  return {parameters, seed};
}

/// A keyframer and what is shown of it.
struct Watched {
  joint::JointKeyframer keyframer{JointKeyframerParameters{}};
  HealthWatch watch;

  void add(const model::LandmarkScan& scan) {
    const KeyframerCounters before = keyframer.counters();
    keyframer.add(scan);
    watch.add(scan, before, keyframer.counters());
  }
  bool shows(wire::Reason reason) const {
    return std::ranges::any_of(watch.conditions(), [&](const bus::WatchedCondition& one) {
      return one.reason == reason && one.condition.holds();
    });
  }
  bool is_well() const {
    return !shows(wire::Reason::kLost) && !shows(wire::Reason::kWithheld) &&
           !shows(wire::Reason::kInputRefused);
  }
};

}  // namespace

TEST_CASE("A keyframer with good scans is well", "[health]") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const sim::Drive drive = forest_drive(seed);
    Watched watched;
    for (std::size_t k = 0; k < drive.size(); ++k) {
      watched.add(drive.scan(k).scan);
      REQUIRE(watched.is_well());
    }
  }
}

TEST_CASE("A keyframer that begins anew again and again is lost, and well again later",
          "[health]") {
  const sim::Drive here = forest_drive(5);
  const sim::Drive there = forest_drive(95);
  Watched watched;
  for (std::size_t k = 0; k < 40; ++k) watched.add((k % 2 == 0 ? here : there).scan(k).scan);
  CHECK(watched.shows(wire::Reason::kLost));
  CHECK(watched.shows(wire::Reason::kWithheld));
  for (std::size_t k = 40; k < 140; ++k) watched.add(here.scan(k).scan);
  CHECK(watched.is_well());
}

TEST_CASE("A keyframer to which scans come late says so", "[health]") {
  const sim::Drive drive = forest_drive(6);
  Watched watched;
  watched.add(drive.scan(50).scan);
  for (std::size_t k = 0; k < 10; ++k) watched.add(drive.scan(k).scan);
  CHECK(watched.shows(wire::Reason::kInputRefused));
}

TEST_CASE("A keyframer that gives no keyframe though detections come is lost", "[health]") {
  HealthParameters parameters;
  HealthWatch watch(parameters);
  const model::LandmarkScan scan = forest_drive(7).scan(0).scan;
  for (int k = 0; k <= parameters.keyframe_within_scans; ++k) watch.add(scan, {}, {});
  CHECK_FALSE(watch.conditions()[0].condition.holds());
  for (int k = 0; k < parameters.lost.raise_at; ++k) watch.add(scan, {}, {});
  CHECK(watch.conditions()[0].condition.holds());

  // Without detections nothing can be said.
  HealthWatch idle(parameters);
  for (int k = 0; k < 1000; ++k) idle.add({}, {}, {});
  CHECK_FALSE(idle.conditions()[0].condition.holds());
}

TEST_CASE("Landmarks that jump where odometry does not are named", "[health]") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const sim::Drive drive = forest_drive(seed);
    joint::JointKeyframer keyframer{JointKeyframerParameters{}};
    int jumps = 0;
    for (std::size_t k = 0; k < 60; ++k) {
      if (k > 0) {
        model::Odometry increment;
        increment.from_utime = drive.utime(k - 1);
        increment.utime = drive.utime(k);
        increment.has_wheels = true;
        increment.from_T_to = drive.world_T_vehicle()[k - 1].inverse() * drive.world_T_vehicle()[k];
        increment.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal();
        keyframer.add(increment);
      }

      model::LandmarkScan scan = drive.scan(k).scan;
      if (k >= 40) {
        for (model::Detection& one : scan.detections) one.position_m.x() += 3.0;
      }
      keyframer.add(scan);
      if (keyframer.input_quality().contradicts_odometry) ++jumps;
      CHECK((jumps > 0) == (k >= 40));
    }
    CHECK(jumps < 4);
  }
}

TEST_CASE("What landmarks and odometry contradict each other in is named", "[health]") {
  const auto after = [](const keyframer::CalibrationError& calibration) {
    HealthWatch watch;
    const model::LandmarkScan scan;
    for (int k = 0; k < 20; ++k) watch.add(scan, {}, {}, {false, calibration, {}, false});
    return watch;
  };
  const auto shows = [](const HealthWatch& watch, wire::Reason reason, std::string_view channel) {
    return std::ranges::any_of(watch.conditions(), [&](const bus::WatchedCondition& one) {
      return one.reason == reason && one.channel == channel && one.condition.holds();
    });
  };
  keyframer::CalibrationError none;
  none.yaw_sigma_rad = none.scale_sigma = 0.002;
  none.place_sigma_m.setConstant(0.005);
  CHECK_FALSE(after(none).is_miscalibrated());

  // Large and sure, for each number; large but not sure is not named.
  auto turned = none;
  turned.yaw_rad = -0.03;
  CHECK(shows(after(turned), wire::Reason::kMiscalibrated, "LANDMARKS"));
  turned.yaw_sigma_rad = 0.01;
  CHECK_FALSE(after(turned).is_miscalibrated());
  auto displaced = none;
  displaced.place_m.y() = 0.05;
  CHECK(shows(after(displaced), wire::Reason::kMiscalibrated, "LANDMARKS"));
  auto late = none;  // By less than moves the pose, by more, and by more but not sure.
  late.speed_mps = 3.0;
  late.late_s = 0.01;
  late.late_sigma_s = 0.001;
  CHECK_FALSE(after(late).is_miscalibrated());
  late.late_s = -0.02;
  CHECK(shows(after(late), wire::Reason::kMiscalibrated, ""));
  late.late_sigma_s = 0.01;
  CHECK_FALSE(after(late).is_miscalibrated());
  auto turning = none;
  turning.rate_rad_s = 1.0;
  turning.late_s = 0.02;
  turning.late_sigma_s = 0.001;
  CHECK(shows(after(turning), wire::Reason::kMiscalibrated, ""));
  auto longer = none;
  longer.scale = 0.03;
  CHECK(shows(after(longer), wire::Reason::kMiscalibrated, "ODOMETRY"));
  // In an even curve the sensor's mounting as a whole; nothing where the turns do not agree.
  auto curve = none;
  curve.sensor_sigmas = 12.0;
  CHECK_FALSE(after(curve).is_miscalibrated());
  curve.mount_yaw_rad = 0.05;
  CHECK(shows(after(curve), wire::Reason::kMiscalibrated, "LANDMARKS"));
  curve.sensor_sigmas = 6.0;
  CHECK_FALSE(after(curve).is_miscalibrated());
  auto wrong_gyro = none;
  wrong_gyro.turn_chi2 = 20.0;
  wrong_gyro.yaw_rad = wrong_gyro.place_m.x() = wrong_gyro.scale = 0.1;
  CHECK_FALSE(after(wrong_gyro).is_miscalibrated());
  auto backwards = none;  // Its cosine is no scale.
  backwards.yaw_rad = 0.5;
  backwards.scale = -0.2;
  CHECK_FALSE(shows(after(backwards), wire::Reason::kMiscalibrated, "ODOMETRY"));
  HealthWatch jumped;
  for (int k = 0; k < 20; ++k) jumped.add({}, {}, {}, {false, none, none, k == 10});
  CHECK(shows(jumped, wire::Reason::kDiverged, ""));
  auto shaken = none;
  shaken.turn_chi2 = 6.0;
  CHECK(shows(after(shaken), wire::Reason::kNoiseMisstated, "LANDMARKS"));
  CHECK_FALSE(after(shaken).is_miscalibrated());
}

namespace {

/// Whether scans that are late by so much are called so after a minute or two in gentle bends.
bool named_after(double seconds, double late_s, std::uint64_t seed) {
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 300.0;
  const sim::TrunkField field = sim::make_trunk_field(forest, seed);
  sim::InertialDriveParameters parameters;
  parameters.stationary_s = 2.0;
  parameters.loop_length_m = 400.0;
  parameters.range_m = 20.0;
  parameters.position_sigma_m = 0.03;
  parameters.odometry = sim::OdometryKind::kInertialAndWheels;
  sim::InertialDrive drive(parameters, field, seed);

  joint::JointKeyframer keyframer{JointKeyframerParameters{}};
  HealthWatch watch;
  for (int k = 0; k < static_cast<int>(10.0 * seconds); ++k) {
    sim::DriveStep step = drive.next();
    const Eigen::Vector2d velocity_mps =
        step.world_T_vehicle.rotation().transpose() * step.velocity_mps;
    const geometry::SE2 then_T_now = geometry::SE2::Exp(
        late_s * Eigen::Vector3d(velocity_mps.x(), velocity_mps.y(), step.rate_rad_s));
    for (model::Detection& one : step.scan.detections) {
      one.position_m.head<2>() = then_T_now * Eigen::Vector2d(one.position_m.head<2>());
    }
    for (const model::Odometry& increment : step.odometry) keyframer.add(increment);
    const KeyframerCounters before = keyframer.counters();
    keyframer.add(step.scan);
    watch.add(step.scan, before, keyframer.counters(), keyframer.input_quality());
    if (late_s == 0.0 && watch.is_miscalibrated()) return true;
  }
  return watch.is_miscalibrated();
}

}  // namespace

TEST_CASE("Each condition has a name of its own", "[health]") {
  std::set<std::pair<wire::Reason, std::string>> names;
  const HealthWatch watch;
  for (const bus::WatchedCondition& one : watch.conditions()) {
    CHECK(names.emplace(one.reason, one.channel).second);
  }
}

TEST_CASE("Scans that are late or early by a constant are named", "[health]") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CHECK(named_after(30.0, 0.2, seed));
    CHECK(named_after(60.0, -0.1, seed));
    CHECK(named_after(60.0, 0.02, seed));
    CHECK_FALSE(named_after(60.0, 0.0, seed));
  }
}
