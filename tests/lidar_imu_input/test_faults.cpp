#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

/// A drive of which each message can be changed or left out; keeps what came of it.
struct FaultyRun {
  std::function<bool(model::ImuSample&)> imu = [](model::ImuSample&) { return true; };
  std::function<bool(model::WheelSample&)> wheels = [](model::WheelSample&) { return true; };
  std::function<bool(model::PointSweep&)> sweep = [](model::PointSweep&) { return true; };

  std::map<InputFaultKind, int> faults;
  std::map<std::string, int> channels;  ///< Faults per channel.
  int sweeps = 0;
  model::Utime largest_gap_us = 0;  ///< Between ends of increments.
  double position_error_m = 0.0;    ///< Of RAW_POSE at the end, over the drive.
  double heading_variance = 0.0;    ///< The largest of an increment's after 26 s.
  InputCounters counters;

  void go(double length_s = 34.0) {
    test::Drive drive;
    const test::Track track(drive, length_s + 1.0);
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    test::SensorErrors errors;
    errors.gyro_noise = 3e-4;
    errors.force_noise = 4e-3;
    errors.wheel_noise_mps = 0.02;
    LidarImuInput input(test::parameters_for_drive());
    std::vector<Eigen::Vector3d> world(100, Eigen::Vector3d(20.0, 5.0, 1.0));
    for (std::size_t i = 0; i < world.size(); ++i) world[i].y() += static_cast<double>(i);
    for (model::Utime t = 0; test::seconds(t) < length_s; t += 10'000) {
      model::ImuSample imu_sample = imu_at(drive, t, 100.0, errors, random);
      model::WheelSample wheel_sample = wheels_at(drive, t, errors, random);
      if (imu(imu_sample)) take(input.add(imu_sample));
      if (t % 20'000 == 0 && wheels(wheel_sample)) take(input.add(wheel_sample));
      if (t >= 200'000 && t % 100'000 == 0) {
        model::PointSweep turn = sweep_at(track, t - 101'000, Eigen::Isometry3d::Identity(), world);
        for (model::SweepPoint& p : turn.points)
          p.x_m += 1e-3F * static_cast<float>(normal(random));
        if (sweep(turn)) take(input.add(turn));
      }
    }
    take(input.finish());
    counters = input.counters();
    const geometry::SE2 truth = track.planar(0.0).inverse() * track.planar(length_s - 0.01);
    position_error_m =
        (input.motion().raw_pose().odom_T_vehicle.translation() - truth.translation()).norm();
  }

 private:
  void take(const InputResults& results) {
    for (const InputResult& result : results) {
      if (const auto* fault = std::get_if<InputFault>(&result)) {
        ++faults[fault->kind];
        ++channels[fault->channel];
      }
      if (const auto* odometry = std::get_if<model::Odometry>(&result)) {
        CHECK(odometry->utime > last_odometry_);
        if (last_odometry_ > 0)
          largest_gap_us = std::max(largest_gap_us, odometry->utime - last_odometry_);
        last_odometry_ = odometry->utime;
        CHECK(odometry->covariance.allFinite());
        if (test::seconds(odometry->utime) > 26.0)
          heading_variance = std::max(heading_variance, odometry->covariance(2, 2));
        CHECK(odometry->from_T_to.coordinates().allFinite());
      }
      if (const auto* turn = std::get_if<model::PointSweep>(&result)) {
        CHECK(turn->utime > last_sweep_);
        last_sweep_ = turn->utime;
        ++sweeps;
        for (const model::SweepPoint& p : turn->points) CHECK(p.position().allFinite());
      }
      if (const auto* pose = std::get_if<model::RawPose>(&result)) {
        CHECK(pose->utime > last_pose_);
        last_pose_ = pose->utime;
        CHECK(pose->odom_T_vehicle.coordinates().allFinite());
      }
      if (const auto* sample = std::get_if<model::ImuSample>(&result)) {
        CHECK(sample->utime > last_imu_);
        last_imu_ = sample->utime;
      }
    }
  }
  model::Utime last_odometry_ = -1;
  model::Utime last_sweep_ = -1;
  model::Utime last_pose_ = -1;
  model::Utime last_imu_ = -1;
};

bool within(model::Utime t, double from_s, double to_s) {
  return test::seconds(t) >= from_s && test::seconds(t) < to_s;
}

}  // namespace

TEST_CASE("a drive without faults reports none", "[faults]") {
  FaultyRun run;
  run.go();
  CHECK(run.faults.empty());
  CHECK(run.sweeps >= 337);
  CHECK(run.position_error_m < 0.5);
}

TEST_CASE("an IMU that stops is named, and the wheels carry on", "[faults]") {
  FaultyRun run;
  run.imu = [](model::ImuSample& s) { return !within(s.utime, 26.0, 31.0); };
  run.go();
  CHECK(run.faults[InputFaultKind::kSilent] == 1);
  CHECK(run.channels["RAW_IMU"] == 1);
  CHECK(run.sweeps >= 337);
  CHECK(run.largest_gap_us <= 200'000);
  // Steering is said to be straight here while the vehicle turns by about a radian.
  CHECK(run.position_error_m < 40.0);
}

TEST_CASE("wheels that stop are named, and the IMU carries on", "[faults]") {
  FaultyRun run;
  run.wheels = [](model::WheelSample& s) { return !within(s.utime, 26.0, 31.0); };
  run.go();
  CHECK(run.faults[InputFaultKind::kSilent] == 1);
  CHECK(run.sweeps >= 337);
  CHECK(run.position_error_m < 2.0);
}

TEST_CASE("IMU and wheels both stop: sweeps do not wait for ever", "[faults]") {
  FaultyRun run;
  run.imu = [](model::ImuSample& s) { return !within(s.utime, 26.0, 31.0); };
  run.wheels = [](model::WheelSample& s) { return !within(s.utime, 26.0, 31.0); };
  run.go();
  CHECK(run.faults[InputFaultKind::kSilent] == 2);
  CHECK(run.faults[InputFaultKind::kNoMotion] > 30);
  CHECK(run.sweeps >= 337);
  CHECK(run.counters.increments_missing > 0);
}

TEST_CASE("a laser that stops is named", "[faults]") {
  FaultyRun run;
  run.sweep = [](model::PointSweep& s) { return !within(s.utime, 26.0, 31.0); };
  run.go();
  CHECK(run.faults[InputFaultKind::kSilent] == 1);
  CHECK(run.channels["RAW_SWEEP"] == 1);
  CHECK(run.largest_gap_us <= 110'000);
}

TEST_CASE("a clock that jumps back by a second is followed within two", "[faults]") {
  const int which = GENERATE(0, 1, 2, 3);
  FaultyRun run;
  const auto jump = [](model::Utime& utime) {
    if (test::seconds(utime) >= 27.0) utime -= 1'000'000;
    return true;
  };
  if (which == 0 || which == 3) run.imu = [&](model::ImuSample& s) { return jump(s.utime); };
  if (which == 1 || which == 3) run.wheels = [&](model::WheelSample& s) { return jump(s.utime); };
  if (which == 2 || which == 3) run.sweep = [&](model::PointSweep& s) { return jump(s.utime); };
  run.go();
  CAPTURE(which, run.position_error_m, run.sweeps, run.largest_gap_us);
  CHECK(run.faults[InputFaultKind::kClockJump] == (which == 3 ? 6 : 2));
  CHECK(run.sweeps >= 330);
  CHECK(run.position_error_m < 2.0);
}

TEST_CASE("a clock that jumps ahead is followed", "[faults]") {
  FaultyRun run;
  run.imu = [](model::ImuSample& s) {
    if (test::seconds(s.utime) >= 27.0) s.utime += 5'000'000;
    return true;
  };
  run.go();
  CHECK(run.faults[InputFaultKind::kClockJump] == 2);
  CHECK(run.sweeps >= 330);
  CHECK(run.position_error_m < 2.0);
}

TEST_CASE("all clocks that go far back are another recording, one alone is a clock", "[faults]") {
  const auto back_us = GENERATE(as<model::Utime>(), 12'000'000, 26'000'000, 3'600'000'000);
  const bool all = GENERATE(true, false);
  FaultyRun run;
  const auto jump = [back_us](model::Utime& utime) {
    if (test::seconds(utime) >= 27.0) utime -= back_us;
    return true;
  };
  run.imu = [&](model::ImuSample& s) { return jump(s.utime); };
  if (all) run.wheels = [&](model::WheelSample& s) { return jump(s.utime); };
  // The first recording ends with a whole revolution.
  if (all)
    run.sweep = [&](model::PointSweep& s) {
      return !within(s.utime, 26.85, 27.0) && jump(s.utime);
    };
  run.go();
  CAPTURE(back_us, all, run.sweeps, run.largest_gap_us);
  CHECK(run.sweeps >= 330);
  CHECK(run.faults[InputFaultKind::kPaused] == (all ? 1 : 0));
  CHECK(run.faults[InputFaultKind::kClockJump] == (all ? 0 : 2));
  // Nobody knows the motion over the gap: who uses it must not take one drive for the other.
  if (all) CHECK(run.largest_gap_us >= 2'000'000);
  if (all) CHECK(run.largest_gap_us <= 2'300'000);
}

TEST_CASE("a sensor whose messages come late in one burst is no other recording", "[faults]") {
  const test::Drive drive;
  std::mt19937_64 random(5);
  LidarImuInput input(test::parameters_for_drive());
  std::vector<model::ImuSample> held;
  int restarts = 0;
  const auto take = [&](const InputResults& results) {
    for (const InputResult& result : results) {
      const auto* fault = std::get_if<InputFault>(&result);
      if (fault != nullptr && fault->kind == InputFaultKind::kPaused) ++restarts;
    }
  };
  for (model::Utime t = 0; t < 34'000'000; t += 10'000) {
    const model::ImuSample sample = imu_at(drive, t, 100.0, {}, random);
    if (within(t, 5.0, 30.0)) {
      held.push_back(sample);
    } else {
      for (const model::ImuSample& late : std::exchange(held, {})) take(input.add(late));
      take(input.add(sample));
    }
    if (t % 20'000 == 0) take(input.add(wheels_at(drive, t, {}, random)));
  }
  CHECK(restarts == 0);
}

TEST_CASE("an IMU that comes late in one burst counts once, with the wheels of its time",
          "[faults]") {
  const bool is_held = GENERATE(false, true);
  const test::Drive drive;
  const test::Track track(drive, 36.0);
  std::mt19937_64 random(6);
  LidarImuInput input(test::parameters_for_drive());
  std::vector<model::ImuSample> held;
  std::optional<model::RawPose> pose;
  double way_m = 0.0;
  double true_way_m = 0.0;
  const auto take = [&](const InputResults& results) {
    for (const InputResult& result : results) {
      const auto* one = std::get_if<model::RawPose>(&result);
      if (one == nullptr) continue;
      if (pose) {
        const auto moved_m = [](const geometry::SE2& a, const geometry::SE2& b) {
          return (b.translation() - a.translation()).norm();
        };
        way_m += moved_m(pose->odom_T_vehicle, one->odom_T_vehicle);
        true_way_m += moved_m(track.planar(test::seconds(pose->utime)),
                              track.planar(test::seconds(one->utime)));
      }
      pose = *one;
    }
  };
  for (model::Utime t = 0; t < 35'000'000; t += 10'000) {
    const model::ImuSample sample = imu_at(drive, t, 100.0, {}, random);
    if (is_held && within(t, 26.0, 32.0)) {
      held.push_back(sample);
    } else {
      for (const model::ImuSample& late : std::exchange(held, {})) take(input.add(late));
      take(input.add(sample));
    }
    if (t % 20'000 == 0) take(input.add(wheels_at(drive, t, {}, random)));
  }
  CHECK(true_way_m > 30.0);
  CHECK(std::abs(way_m - true_way_m) < 0.02 * true_way_m);
  CHECK(std::abs(input.motion().attitude()->wheel_scale() - 1.0) < 0.01);
}

TEST_CASE("values that are not finite are dropped and counted", "[faults]") {
  FaultyRun run;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int count = 0;
  run.imu = [&](model::ImuSample& s) {
    if (within(s.utime, 26.0, 27.0) && ++count % 3 == 0) s.specific_force_mps2.x() = nan;
    return true;
  };
  run.sweep = [](model::PointSweep& s) {
    if (within(s.utime, 28.0, 28.5)) s.points[3].x_m = std::numeric_limits<float>::infinity();
    if (within(s.utime, 29.0, 29.1))
      for (model::SweepPoint& p : s.points) p.z_m = std::numeric_limits<float>::quiet_NaN();
    return true;
  };
  run.go();
  CHECK(run.faults[InputFaultKind::kNotFinite] == 33 + 6);
  CHECK(run.counters.points_dropped == 5 + 100);
  CHECK(run.position_error_m < 1.0);
}

TEST_CASE("a saturated IMU is counted", "[faults]") {
  FaultyRun run;
  run.imu = [](model::ImuSample& s) {
    if (within(s.utime, 27.0, 27.295)) s.angular_rate_rad_s.z() = 8.7;
    return true;
  };
  run.go();
  CHECK(run.faults[InputFaultKind::kSaturated] == 30);
  CHECK(run.counters.samples_saturated == 30);
}

TEST_CASE("a bump that saturates the IMU widens the increment across it", "[faults]") {
  FaultyRun even;
  even.go();
  FaultyRun bump;
  bump.imu = [](model::ImuSample& s) {
    if (within(s.utime, 27.0, 27.025)) s.angular_rate_rad_s.z() = 8.7;
    return true;
  };
  bump.go();
  CHECK(bump.faults[InputFaultKind::kSaturated] == 3);
  // 2 rad/s/sqrt(Hz) over the 0.04 s between the samples beside it.
  CHECK(bump.heading_variance - even.heading_variance == Approx(0.16).epsilon(0.05));
}

TEST_CASE("a frozen IMU is named and not used", "[faults]") {
  FaultyRun run;
  model::ImuSample frozen;
  run.imu = [&](model::ImuSample& s) {
    if (within(s.utime, 26.0, 29.0)) {
      s.angular_rate_rad_s = frozen.angular_rate_rad_s;
      s.specific_force_mps2 = frozen.specific_force_mps2;
    } else {
      frozen = s;
    }
    return true;
  };
  run.go();
  CHECK(run.faults[InputFaultKind::kFrozen] == 1);
  CHECK(run.faults[InputFaultKind::kSilent] == 1);
  CHECK(run.sweeps >= 337);
}

TEST_CASE("messages that repeat or come out of order are dropped", "[faults]") {
  LidarImuInput input(test::parameters_for_drive());
  std::mt19937_64 random(1);
  model::ImuSample sample;
  for (model::Utime t = 50'000; t <= 100'000; t += 10'000) {
    sample = imu_at({}, t, 100.0, {}, random);
    input.add(sample);
  }
  const InputResults again = input.add(sample);
  REQUIRE(again.size() == 1);
  CHECK(std::get<InputFault>(again[0]).kind == InputFaultKind::kLate);
}
