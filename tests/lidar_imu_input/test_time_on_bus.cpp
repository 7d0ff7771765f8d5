// The input as a service: wrong stamps, clocks that jump together, messages out of order.
#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

struct Sent {
  model::Utime at = 0;
  std::string channel;
  wire::Bytes bytes;
};

/// A drive with IMU, wheels and sweeps in parts; stamps from `from` on are moved by `moved`.
std::vector<Sent> sent_in(double length_s, model::Utime from = 1'000'000'000,
                          model::Utime moved = 0) {
  const test::Drive drive;
  const test::Track track(drive, length_s + 1.0);
  std::mt19937_64 random(1);
  test::SensorErrors errors;
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  std::vector<Eigen::Vector3d> world;
  for (int i = 0; i < 60; ++i) world.emplace_back(8.0 + i, 20.0 - i, 1.0);
  std::vector<Sent> all;
  std::uint64_t imus = 0;
  std::uint64_t parts = 0;
  std::uint64_t wheel_samples = 0;
  for (model::Utime t = 0; test::seconds(t) < length_s; t += 10'000) {
    const model::Utime by = t >= from ? moved : 0;
    const auto add = [&](const char* channel, auto value, std::uint64_t& count) {
      value.utime += by;
      value.sequence = count++;
      all.push_back({t, channel, wire::encode_message(value)});
    };
    add("RAW_IMU", imu_at(drive, t, 100.0, errors, random), imus);
    if (t % 20'000 == 0) add("RAW_WHEELS", wheels_at(drive, t, errors, random), wheel_samples);
    if (t < 100'000 || t % 100'000 != 0) continue;
    model::PointSweep sweep = sweep_at(track, t - 100'000, Eigen::Isometry3d::Identity(), world);
    sweep.revolution = static_cast<std::uint64_t>(t / 100'000);
    for (const model::PointSweep& part : split_sweep(sweep, 15)) add("RAW_SWEEP", part, parts);
  }
  return all;
}

struct Hosted {
  Hosted()
      : service(lidar_imu_input_service({}), bus, bus::no_clock(), "wheels.encoder_left_m = 0.0\n",
                "test.toml") {
    for (const char* channel : {"ODOMETRY", "IMU", "WHEELS", "LIDAR_SWEEP"}) {
      bus.subscribe(channel, 0, [this](const bus::BusMessage& message) {
        outputs[std::string(message.channel)].emplace_back(message.bytes.begin(),
                                                           message.bytes.end());
      });
    }
    service.node().connect();
  }
  void send(const std::string& channel, const wire::Bytes& bytes) {
    bus.publish(channel, bytes);
    bus.drain();
  }
  std::int64_t count(const std::string& channel, wire::Reason reason) {
    return service.node().monitor().count_of(channel, reason);
  }

  bus::MemoryBus bus{bus::MemoryBus::Queues::kUnlimited};
  bus::HostedService service;
  std::map<std::string, std::vector<wire::Bytes>> outputs;
};

}  // namespace

TEST_CASE("on the bus, a first message of the year 2001 stops nothing", "[time]") {
  for (const std::string channel : {"RAW_GNSS", "RAW_IMU"}) {
    Hosted hosted;
    model::GnssFix fix;
    fix.utime = 1'000'000'000'000;
    fix.sigma_m = 1.0;
    model::ImuSample sample;
    sample.utime = fix.utime;
    sample.specific_force_mps2.z() = 9.81;
    hosted.send(channel,
                channel == "RAW_GNSS" ? wire::encode_message(fix) : wire::encode_message(sample));
    for (const Sent& one : sent_in(4.0)) hosted.send(one.channel, one.bytes);
    CAPTURE(channel);
    CHECK(hosted.outputs["LIDAR_SWEEP"].size() >= 37);
    CHECK(hosted.outputs["ODOMETRY"].size() >= 37);
  }
}

TEST_CASE("the filter's feedback is heard after all clocks have jumped back", "[time]") {
  Hosted hosted;
  std::uint64_t sequence = 0;
  std::size_t sweeps_before = 0;
  for (const Sent& one : sent_in(36.0, 30'000'000, -27'000'000)) {
    hosted.send(one.channel, one.bytes);
    if (one.channel != "RAW_WHEELS" || one.at % 100'000 != 0) continue;
    // From the filter, which is on the time of ODOMETRY.
    model::VelocityCorrection correction;
    correction.utime =
        wire::decode_message<model::Odometry>(hosted.outputs["ODOMETRY"].empty()
                                                  ? wire::encode_message(model::Odometry{})
                                                  : hosted.outputs["ODOMETRY"].back())
            ->utime;
    correction.sequence = sequence++;
    correction.velocity_mps.x() = test::Drive{}.speed(test::seconds(one.at) - 0.1);
    correction.covariance.diagonal() << 1e-3, 1e-3, 1e-7, 1e-4, 1e-4;
    if (one.at > 1'000'000) hosted.send("VELOCITY_CORRECTION", wire::encode_message(correction));
    if (one.at < 30'000'000) sweeps_before = hosted.outputs["LIDAR_SWEEP"].size();
  }
  CHECK(hosted.count("VELOCITY_CORRECTION", wire::Reason::kClockJump) == 0);
  CHECK(hosted.outputs["LIDAR_SWEEP"].size() > sweeps_before + 50);
}

TEST_CASE("on the bus, messages up to 20 ms out of order give the same bytes", "[time][order]") {
  const std::vector<Sent> clean = sent_in(26.0);
  Hosted should;
  for (const Sent& one : clean) should.send(one.channel, one.bytes);
  std::vector<Sent> mixed = clean;
  std::mt19937_64 random(31);
  std::uniform_int_distribution<model::Utime> delay(0, 20'000);
  for (Sent& one : mixed)
    if (one.at > 1'000'000 || one.channel != "RAW_SWEEP") one.at += delay(random);
  std::ranges::stable_sort(mixed, {}, &Sent::at);
  Hosted is;
  for (const Sent& one : mixed) is.send(one.channel, one.bytes);
  for (const char* channel : {"ODOMETRY", "IMU", "WHEELS", "LIDAR_SWEEP"}) {
    CAPTURE(channel);
    // The last ones may still wait.
    auto& all = should.outputs[channel];
    REQUIRE(is.outputs[channel].size() + 4 >= all.size());
    all.resize(is.outputs[channel].size());
    CHECK(is.outputs[channel] == all);
  }
  for (const char* channel : {"RAW_IMU", "RAW_WHEELS", "RAW_SWEEP"}) {
    CHECK(is.count(channel, wire::Reason::kLate) == 0);
    CHECK(is.count(channel, wire::Reason::kPartsMissing) == 0);
  }
}
