// The input stage as a process that is killed in the middle of a drive and started again.
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "common/bus/state_store.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

constexpr model::Utime kStep_us = 10'000;

/// From its start until it is killed: nothing is saved at the end.
struct Life {
  explicit Life(const fs::path& directory)
      : hosted(lidar_imu_input_service({}), bus, bus::no_clock(), "wheels.encoder_left_m = 0.0\n",
               "test.toml"),
        store(directory, "lidar_imu_input") {
    bus.subscribe("RAW_POSE", 0, [this](const bus::BusMessage& message) {
      poses.push_back(*wire::decode_message<model::RawPose>(message.bytes));
    });
    bus.subscribe("ODOMETRY", 0, [this](const bus::BusMessage& message) {
      increments.push_back(*wire::decode_message<model::Odometry>(message.bytes));
    });
    REQUIRE(hosted.node().recover(store));
    hosted.node().journal_to(&store);
    hosted.node().connect();
    bus.drain();
  }
  void run(model::Utime from, model::Utime to) {
    const test::Drive drive;
    test::SensorErrors errors;
    errors.gyro_bias = {0.003, -0.002, 0.004};
    std::mt19937_64 random(1);
    for (model::Utime t = from; t < to; t += kStep_us) {
      model::ImuSample imu = imu_at(drive, t, 100.0, errors, random);
      imu.sequence = static_cast<std::uint64_t>(t / kStep_us);
      bus.publish("RAW_IMU", wire::encode_message(imu));
      model::WheelSample wheels = wheels_at(drive, t, errors, random);
      wheels.sequence = imu.sequence;
      bus.publish("RAW_WHEELS", wire::encode_message(wheels));
      bus.drain();
    }
  }

  bus::MemoryBus bus{bus::MemoryBus::Queues::kUnlimited};
  bus::HostedService hosted;
  bus::StateStore store;
  std::vector<model::RawPose> poses;
  std::vector<model::Odometry> increments;
};

}  // namespace

TEST_CASE("killed in the middle of a drive, the input goes on bit by bit", "[state]") {
  const test::Scratch scratch("input");
  const fs::path uncut_directory = scratch.path() / "uncut";
  const fs::path cut_directory = scratch.path() / "cut";
  fs::create_directories(uncut_directory);
  fs::create_directories(cut_directory);
  // Between two snapshots, so that the journal has to be read as well.
  constexpr model::Utime kKilled = 27'730'000;
  constexpr model::Utime kEnd = 32'000'000;
  Life uncut(uncut_directory);
  uncut.run(kStep_us, kEnd);
  {
    Life first(cut_directory);
    first.run(kStep_us, kKilled);
    CHECK(first.increments.size() > 200);
  }
  Life second(cut_directory);
  CHECK(second.poses.empty());
  second.run(kKilled, kEnd);
  REQUIRE(second.increments.size() > 30);
  REQUIRE(second.poses.size() > 100);
  const auto after = [&](const auto& all, std::size_t count) {
    return std::vector(all.end() - static_cast<std::ptrdiff_t>(count), all.end());
  };
  const auto increments = after(uncut.increments, second.increments.size());
  for (std::size_t i = 0; i < increments.size(); ++i)
    REQUIRE(wire::encode_message(second.increments[i]) == wire::encode_message(increments[i]));

  const auto poses = after(uncut.poses, second.poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    REQUIRE(wire::encode_message(second.poses[i]) == wire::encode_message(poses[i]));
}
