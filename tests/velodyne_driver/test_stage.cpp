// The stage by itself, without a socket: what it says of packets that are wrong or missing.
#include "services/velodyne_driver/velodyne_driver.hpp"
#include "tests/catch.hpp"
#include "tests/io/velodyne_packets.hpp"

using namespace understory;
using namespace understory::velodyne_driver;

namespace {

VelodyneDriver driver() {
  return {VelodyneDriverParameters{}, velodyne_calibration(io::velodyne_model("vlp16").value())};
}

/// Adds the packets as they come; what was wrong with them.
std::vector<wire::Refusal> faults_of(VelodyneDriver& driver, test::PacketMaker& maker,
                                     int packets) {
  std::vector<wire::Refusal> faults;
  for (int i = 0; i < packets; ++i) {
    const test::Packet packet = maker.next();
    const auto output =
        driver.add_data(packet, packet.size(), static_cast<model::Utime>(maker.time_us));
    faults.insert(faults.end(), output.faults.begin(), output.faults.end());
  }
  return faults;
}

}  // namespace

TEST_CASE("a packet of another size is too short or too long", "[velodyne_driver]") {
  VelodyneDriver stage = driver();
  const auto reason_of = [](const lidar_driver::DriverOutput& output) {
    REQUIRE(output.faults.size() == 1);
    return output.faults[0].reason;
  };
  for (const std::size_t size : {0, 1, 100, 511, 513, 1205, 1207, 3000}) {
    CAPTURE(size);
    const test::Packet packet(size, 0);
    CHECK(reason_of(stage.add_data(packet, size, 0)) ==
          (size < io::kVelodyneDataBytes ? wire::Reason::kTooShort : wire::Reason::kTooLong));
    CHECK(reason_of(stage.add_position(packet, size, 0)) ==
          (size < io::kVelodynePositionBytes ? wire::Reason::kTooShort : wire::Reason::kTooLong));
  }
  CHECK(stage.counts().wrong_size == 8);
  CHECK(stage.counts().bad_positions == 8);
}

TEST_CASE("holes are told before and after a pause of the sensor", "[velodyne_driver]") {
  VelodyneDriver stage = driver();
  test::PacketMaker maker{.azimuth = 0};
  const auto lose_packets = [&](int lost) {
    for (int i = 0; i < lost; ++i) maker.next();
  };

  // Three holes, each in a revolution of its own: 75 packets are one.
  CHECK(faults_of(stage, maker, 100).empty());
  for (int hole = 0; hole < 3; ++hole) {
    lose_packets(10);
    const auto faults = faults_of(stage, maker, 65);
    REQUIRE(faults.size() == 1);
    CHECK(faults[0].reason == wire::Reason::kPartsMissing);
  }
  CHECK(stage.counts().holes == 3);

  // A pause, which is told by itself, and one more hole behind it.
  maker.time_us += 700'000.0;
  CHECK(faults_of(stage, maker, 100).size() == 1);
  CHECK(stage.counts().gaps == 1);
  CHECK(stage.counts().holes == 3);
  lose_packets(10);
  CHECK(faults_of(stage, maker, 65).size() == 1);
  CHECK(stage.counts().holes == 4);
}
