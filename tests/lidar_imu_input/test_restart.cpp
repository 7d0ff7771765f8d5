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
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

constexpr Utime kStep_us = 10'000;

/// From its start until it is killed: nothing is saved at the end.
struct Life {
  explicit Life(const fs::path& directory)
      : hosted(lidar_imu_input_service({}), bus, no_clock(), "wheels.encoder_left_m = 0.0\n",
               "test.toml"),
        store(directory, "lidar_imu_input") {
    bus.subscribe("RAW_POSE", 0, [this](const BusMessage& message) {
      poses.push_back(*decode_message<RawPose>(message.bytes));
    });
    bus.subscribe("ODOMETRY", 0, [this](const BusMessage& message) {
      pieces.push_back(*decode_message<Odometry>(message.bytes));
    });
    REQUIRE(hosted.node().recover(store));
    hosted.node().journal_to(&store);
    hosted.node().connect();
    bus.drain();
  }
  void run(Utime from, Utime to) {
    const Drive drive;
    SensorErrors errors;
    errors.gyro_bias = {0.003, -0.002, 0.004};
    std::mt19937_64 random(1);
    for (Utime t = from; t < to; t += kStep_us) {
      ImuSample imu = imu_at(drive, t, 100.0, errors, random);
      imu.sequence = static_cast<std::uint64_t>(t / kStep_us);
      bus.publish("RAW_IMU", encode_message(imu));
      WheelSample wheels = wheels_at(drive, t, errors, random);
      wheels.sequence = imu.sequence;
      bus.publish("RAW_WHEELS", encode_message(wheels));
      bus.drain();
    }
  }

  MemoryBus bus{MemoryBus::Queues::kUnlimited};
  HostedService hosted;
  StateStore store;
  std::vector<RawPose> poses;
  std::vector<Odometry> pieces;
};

}  // namespace

TEST_CASE("killed in the middle of a drive, the input goes on where it was", "[state]") {
  const Scratch scratch("input");
  const fs::path uncut_directory = scratch.path() / "uncut";
  const fs::path cut_directory = scratch.path() / "cut";
  fs::create_directories(uncut_directory);
  fs::create_directories(cut_directory);
  // Between two snapshots, so that the journal has to be read as well.
  constexpr Utime kKilled = 27'730'000;
  constexpr Utime kEnd = 32'000'000;
  Life uncut(uncut_directory);
  uncut.run(kStep_us, kEnd);
  {
    Life first(cut_directory);
    first.run(kStep_us, kKilled);
    CHECK(first.pieces.size() > 200);
  }
  Life second(cut_directory);
  CHECK(second.poses.empty());
  second.run(kKilled, kEnd);
  REQUIRE(second.pieces.size() > 30);
  REQUIRE(second.poses.size() > 100);
  const auto after = [&](const auto& all, std::size_t count) {
    return std::vector(all.end() - static_cast<std::ptrdiff_t>(count), all.end());
  };
  const auto pieces = after(uncut.pieces, second.pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    REQUIRE(second.pieces[i].from_utime == pieces[i].from_utime);
    REQUIRE(second.pieces[i].utime == pieces[i].utime);
    REQUIRE((second.pieces[i].from_T_to.coordinates() - pieces[i].from_T_to.coordinates()).norm() <
            1e-9);
  }
  const auto poses = after(uncut.poses, second.poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    REQUIRE(second.poses[i].utime == poses[i].utime);
    REQUIRE((second.poses[i].odom_T_vehicle.coordinates() - poses[i].odom_T_vehicle.coordinates())
                .norm() < 1e-9);
  }
}
