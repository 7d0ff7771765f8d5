// Stamps that cannot be right, pauses of the sensors and of the stage, and readings out of order.
#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

constexpr model::Utime kSecond = 1'000'000;

/// When a reading comes: some time after it was complete.
struct Arriving {
  model::Utime at = 0;
  RawReading reading;
};

/// All readings of a drive in the order in which they are complete.
struct Recorded {
  double length_s = 32.0;
  bool has_imu = true;
  bool has_wheels = true;
  bool has_sweeps = true;
  bool has_fixes = true;

  std::vector<Arriving> readings() const {
    const test::Drive drive;
    const test::Track track(drive, length_s + 1.0);
    test::SensorErrors errors;
    errors.gyro_bias = {0.003, -0.002, 0.004};
    errors.gyro_noise = 3e-4;
    errors.force_noise = 4e-3;
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(-30.0, 30.0);
    std::vector<Eigen::Vector3d> world;
    for (int i = 0; i < 80; ++i) world.emplace_back(place(random), place(random), 1.0);

    std::vector<Arriving> all;
    std::map<std::size_t, std::uint64_t> sequences;
    const auto add = [&](model::Utime at, RawReading reading) {
      std::visit([&](auto& value) { value.sequence = sequences[reading.index()]++; }, reading);
      all.push_back({at, std::move(reading)});
    };
    for (model::Utime t = 0; test::seconds(t) < length_s; t += 10'000) {
      const model::ImuSample imu = imu_at(drive, t, 100.0, errors, random);
      if (has_imu) add(t, imu);
      if (has_wheels && t % 20'000 == 0) add(t, wheels_at(drive, t, errors, random));
      if (has_fixes && t % kSecond == 0) {
        model::GnssFix fix;
        fix.utime = t;
        fix.sigma_m = 0.5;
        add(t, fix);
      }
      if (has_sweeps && t >= 100'000 && t % 100'000 == 0)
        add(t, sweep_at(track, t - 100'000, Eigen::Isometry3d::Identity(), world));
    }
    return all;
  }
};

/// What came of readings, per kind.
struct Output {
  std::vector<model::Odometry> odometry;
  std::vector<model::ImuSample> imu;
  std::vector<model::WheelSample> wheels;
  std::vector<model::RawPose> poses;
  std::vector<model::PointSweep> sweeps;
  std::vector<InputFault> faults;

  void take(const InputResults& results) {
    for (const InputResult& result : results) {
      if (const auto* value = std::get_if<model::Odometry>(&result)) odometry.push_back(*value);
      if (const auto* value = std::get_if<model::ImuSample>(&result)) imu.push_back(*value);
      if (const auto* value = std::get_if<model::WheelSample>(&result)) wheels.push_back(*value);
      if (const auto* value = std::get_if<model::RawPose>(&result)) poses.push_back(*value);
      if (const auto* value = std::get_if<model::PointSweep>(&result)) sweeps.push_back(*value);
      if (const auto* value = std::get_if<InputFault>(&result)) faults.push_back(*value);
    }
  }
  int faults_of(InputFaultKind kind) const {
    return static_cast<int>(std::ranges::count(faults, kind, &InputFault::kind));
  }
  /// Sweeps from `from_s` on, on average per second until `to_s`.
  double sweeps_per_s(double from_s, double to_s) const {
    return static_cast<double>(std::ranges::count_if(sweeps,
                                                     [&](const model::PointSweep& sweep) {
                                                       return test::seconds(sweep.utime) > from_s &&
                                                              test::seconds(sweep.utime) <= to_s;
                                                     })) /
           (to_s - from_s);
  }
};

Output output_of(const std::vector<Arriving>& readings) {
  LidarImuInput stage(test::parameters_for_drive());
  Output output;
  for (const Arriving& one : readings) output.take(stage.add(one.reading));
  output.take(stage.finish());
  return output;
}

RawReading with_stamp(RawReading reading, model::Utime utime) {
  std::visit([utime](auto& value) { value.utime = utime; }, reading);
  return reading;
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return std::ranges::equal(a, b, [](const T& x, const T& y) {
    return wire::encode_message(x) == wire::encode_message(y);
  });
}

bool same(const std::vector<model::PointSweep>& a, const std::vector<model::PointSweep>& b) {
  return std::ranges::equal(a, b, [](const model::PointSweep& x, const model::PointSweep& y) {
    return x.utime == y.utime && std::ranges::equal(x.points, y.points, [](auto& p, auto& q) {
             return p.x_m == q.x_m && p.y_m == q.y_m && p.z_m == q.z_m && p.time_s == q.time_s;
           });
  });
}

void check_same(const Output& is, const Output& should) {
  CHECK(is.imu.size() == should.imu.size());
  CHECK(same(is.imu, should.imu));
  CHECK(same(is.wheels, should.wheels));
  CHECK(is.odometry.size() == should.odometry.size());
  CHECK(same(is.odometry, should.odometry));
  CHECK(same(is.poses, should.poses));
  CHECK(is.sweeps.size() == should.sweeps.size());
  CHECK(same(is.sweeps, should.sweeps));
}

/// Leaves out what is complete within [from_s, to_s), of all sensors or of one.
std::vector<Arriving> without(std::vector<Arriving> readings, double from_s, double to_s,
                              std::optional<Sensor> sensor = {}) {
  std::erase_if(readings, [&](const Arriving& one) {
    return test::seconds(one.at) >= from_s && test::seconds(one.at) < to_s &&
           (!sensor || sensor_of(one.reading) == *sensor);
  });
  return readings;
}

/// Whether each increment after `from_s` turns as the vehicle did.
double largest_turn_error(const Output& output, double from_s) {
  const test::Drive drive;
  double largest = 0.0;
  for (const model::Odometry& increment : output.odometry) {
    if (test::seconds(increment.from_utime) < from_s) continue;
    const double turned = drive.heading(test::seconds(increment.utime)) -
                          drive.heading(test::seconds(increment.from_utime));
    largest = std::max(largest, std::abs(increment.from_T_to.theta() - turned));
  }
  return largest;
}

}  // namespace

TEST_CASE("one wrong stamp as the first message of a sensor changes nothing", "[time]") {
  const std::vector<Arriving> clean = Recorded{.length_s = 6.0}.readings();
  const Output should = output_of(clean);
  REQUIRE(should.sweeps.size() > 55);
  for (const Sensor sensor : {Sensor::kImu, Sensor::kWheels, Sensor::kGnss, Sensor::kSweep}) {
    for (const model::Utime wrong : {1'000'000 * kSecond, 3 * kSecond}) {
      for (const std::size_t place : {std::size_t{0}, std::size_t{1}, std::size_t{9}}) {
        CAPTURE(channel_of(sensor), wrong, place);
        std::vector<Arriving> readings = clean;
        const auto first = std::ranges::find_if(
            clean, [&](const Arriving& one) { return sensor_of(one.reading) == sensor; });
        readings.insert(readings.begin() + static_cast<std::ptrdiff_t>(place),
                        {0, with_stamp(first->reading, wrong)});
        const Output is = output_of(readings);
        CHECK(same(is.imu, should.imu));
        CHECK(same(is.odometry, should.odometry));
        CHECK(same(is.sweeps, should.sweeps));
        CHECK(is.faults_of(InputFaultKind::kClockJump) >= 1);
      }
    }
  }
}

TEST_CASE("a wrong first stamp is not in the state that is saved", "[time][state]") {
  const std::vector<Arriving> clean = Recorded{.length_s = 8.0}.readings();
  LidarImuInput first(test::parameters_for_drive());
  first.add(with_stamp(clean[0].reading, 1'000'000 * kSecond));
  std::size_t i = 0;
  for (; clean[i].at < 3 * kSecond; ++i) first.add(clean[i].reading);
  LidarImuInput second(test::parameters_for_drive());
  second.load(first.save());
  Output output;
  for (; i < clean.size(); ++i) output.take(second.add(clean[i].reading));
  CHECK(output.sweeps_per_s(3.1, 7.9) == Approx(10.0).epsilon(0.05));
}

TEST_CASE("a receiver that keeps its wrong date does not stop the others", "[time]") {
  std::vector<Arriving> readings = Recorded{.length_s = 12.0}.readings();
  for (Arriving& one : readings) {
    if (sensor_of(one.reading) == Sensor::kGnss)
      one.reading = with_stamp(one.reading, stamp_of(one.reading) + 1'000'000 * kSecond);
  }
  const Output should = output_of(Recorded{.length_s = 12.0, .has_fixes = false}.readings());
  const Output is = output_of(readings);
  CHECK(same(is.odometry, should.odometry));
  CHECK(same(is.sweeps, should.sweeps));
}

TEST_CASE("a pause of all sensors moves no clock", "[time][gap]") {
  const std::vector<Arriving> clean = Recorded{}.readings();
  for (const double seconds : {0.6, 1.06, 2.1, 3.0, 6.0}) {
    // From where the time is at each phase of the sensors.
    for (const double from_s : {24.0, 24.03, 24.07}) {
      CAPTURE(seconds, from_s);
      const Output output = output_of(without(clean, from_s, from_s + seconds));
      CHECK(output.faults_of(InputFaultKind::kClockJump) == 0);
      CHECK(output.faults_of(InputFaultKind::kSilent) == 0);
      CHECK(output.faults_of(InputFaultKind::kPaused) == 1);
      CHECK(output.imu.back().utime == stamp_of(clean.back().reading));
      CHECK(output.sweeps_per_s(from_s + seconds + 0.2, 31.9) == Approx(10.0).epsilon(0.05));
      CHECK(largest_turn_error(output, from_s + seconds) < 0.005);
      for (const model::PointSweep& sweep : output.sweeps) CHECK(sweep.utime % 100'000 == 0);
    }
  }
}

TEST_CASE("the stage's own pause moves no clock", "[time][gap][state]") {
  const std::vector<Arriving> clean = Recorded{}.readings();
  for (const double seconds : {1.06, 2.1, 6.0}) {
    // Loaded from a snapshot, a part of the journal, then silence.
    LidarImuInput stage(test::parameters_for_drive());
    std::size_t i = 0;
    for (; test::seconds(clean[i].at) < 24.0; ++i) stage.add(clean[i].reading);
    LidarImuInput second(test::parameters_for_drive());
    second.load(stage.save());
    Output output;
    for (; i < clean.size(); ++i) {
      const double at_s = test::seconds(clean[i].at);
      if (at_s < 24.5 || at_s >= 24.5 + seconds) output.take(second.add(clean[i].reading));
    }
    output.take(second.finish());
    CAPTURE(seconds);
    CHECK(output.faults_of(InputFaultKind::kClockJump) == 0);
    CHECK(output.faults_of(InputFaultKind::kPaused) == 1);
    CHECK(output.imu.back().utime == stamp_of(clean.back().reading));
    CHECK(largest_turn_error(output, 24.5 + seconds) < 0.005);
  }
}

TEST_CASE("a sensor that is silent for a while comes back on its own clock", "[time][gap]") {
  const std::vector<Arriving> clean = Recorded{}.readings();
  for (const Sensor sensor : {Sensor::kImu, Sensor::kWheels, Sensor::kSweep}) {
    for (const double seconds : {1.1, 3.0, 6.0}) {
      CAPTURE(channel_of(sensor), seconds);
      const Output output = output_of(without(clean, 24.0, 24.0 + seconds, sensor));
      CHECK(output.faults_of(InputFaultKind::kClockJump) == 0);
      CHECK(output.faults_of(InputFaultKind::kPaused) == 0);
      CHECK(output.faults_of(InputFaultKind::kSilent) == 1);
      CHECK(output.wheels.back().utime > 31'900'000);
      CHECK(output.imu.back().utime > 31'900'000);
      CHECK(largest_turn_error(output, 24.1 + seconds) < 0.005);
    }
  }
}

TEST_CASE("sweeps that no IMU levels say how far the vehicle may have tilted", "[gap]") {
  const Output output = output_of(without(Recorded{}.readings(), 24.0, 28.0, Sensor::kImu));
  const auto sigma_rad = [&](double s) {
    const auto sweep = std::ranges::find_if(
        output.sweeps, [&](const model::PointSweep& one) { return test::seconds(one.utime) > s; });
    REQUIRE(sweep != output.sweeps.end());
    REQUIRE(sweep->attitude);
    return std::sqrt(0.5 * sweep->attitude->covariance_rad2.trace());
  };
  CHECK(sigma_rad(23.5) < 0.01);
  CHECK(sigma_rad(24.3) > 0.01);
  CHECK(sigma_rad(25.5) > 0.029);
  CHECK(sigma_rad(27.5) > 0.029);
  CHECK(sigma_rad(27.5) < 0.05);
  CHECK(sigma_rad(31.0) < 0.02);
}

TEST_CASE("all clocks jump back together and stay together", "[time]") {
  std::vector<Arriving> readings = Recorded{.length_s = 40.0}.readings();
  // A second recording, in which the laser speaks first.
  readings = without(readings, 28.0, 28.06, Sensor::kImu);
  readings = without(readings, 28.0, 28.06, Sensor::kWheels);
  for (Arriving& one : readings) {
    if (one.at >= 28 * kSecond)
      one.reading = with_stamp(one.reading, stamp_of(one.reading) - 27 * kSecond);
  }
  const Output output = output_of(readings);
  CHECK(std::ranges::is_sorted(output.imu, std::ranges::less_equal{}, &model::ImuSample::utime));
  CHECK(output.sweeps_per_s(30.0, 38.0) == Approx(10.0).epsilon(0.05));
  // As far apart as on the sensors' own clocks.
  CHECK(output.imu.back().utime - output.sweeps.back().utime == 90'000);
}

TEST_CASE("readings up to 20 ms out of order give the same bytes", "[time][order]") {
  const std::vector<Arriving> clean = Recorded{.length_s = 30.0}.readings();
  const Output should = output_of(clean);
  CHECK(should.faults_of(InputFaultKind::kLate) == 0);
  for (std::uint64_t seed = 11; seed < 15; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<model::Utime> delay(0, 20'000);
    std::vector<Arriving> readings = clean;
    // The first revolution is not expected yet: what came late then is used, but later.
    for (Arriving& one : readings)
      if (one.at > kSecond || sensor_of(one.reading) != Sensor::kSweep) one.at += delay(random);
    std::ranges::stable_sort(readings, {}, &Arriving::at);
    const Output is = output_of(readings);
    check_same(is, should);
    CHECK(is.faults_of(InputFaultKind::kLate) == 0);
  }
}

TEST_CASE("readings in order are not delayed", "[time][order]") {
  LidarImuInput stage(test::parameters_for_drive());
  model::Utime largest_imu_us = 0;
  model::Utime largest_sweep_us = 0;
  for (const Arriving& one : Recorded{.length_s = 12.0}.readings()) {
    for (const InputResult& result : stage.add(one.reading)) {
      if (one.at < kSecond) continue;
      if (const auto* imu = std::get_if<model::ImuSample>(&result))
        largest_imu_us = std::max(largest_imu_us, one.at - imu->utime);
      if (const auto* sweep = std::get_if<model::PointSweep>(&result))
        largest_sweep_us = std::max(largest_sweep_us, one.at - sweep->utime);
    }
  }
  CHECK(largest_imu_us == 0);
  CHECK(largest_sweep_us == 0);
}

TEST_CASE("a laser alone is not called silent", "[time]") {
  const Output output =
      output_of(Recorded{.length_s = 12.0, .has_imu = false, .has_wheels = false}.readings());
  CHECK(output.sweeps.size() >= 118);
  CHECK(output.faults_of(InputFaultKind::kSilent) == 0);
  CHECK(output.faults_of(InputFaultKind::kNoMotion) > 0);
}
