// The drivers of all makers through real sockets: what comes out must be what the import of a
// capture gives, byte for byte, whatever else comes in.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/lidar_driver/driver_family.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// Three makers; Velodyne's driver has tests of its own.
std::vector<Family> three_makers(DriverFixture& fixture, std::vector<MadeUpSensor> sensors) {
  std::erase_if(sensors, [](const auto& one) { return one.description.model == "vlp16"; });
  return fixture.families(sensors);
}

void send(LiveDriver& driver, const Family& family, const SentPacket& packet) {
  const auto port = std::ranges::find(family.ports, packet.port) - family.ports.begin();
  driver.send(packet.bytes, static_cast<std::size_t>(port));
  // Two sockets have no order between them: an IMU packet is taken in where it was sent.
  if (port != 0) driver.settle();
}

}  // namespace

TEST_CASE("every driver publishes what an import gives, byte for byte", "[lidar_driver]") {
  std::mt19937_64 random(1);
  DriverFixture fixture;
  for (const Family& family : three_makers(fixture, made_up_sensors())) {
    CAPTURE(family.sensor.name);
    const MadeUpRecording recording = family.sensor.record(2, wall_us(), random);
    LiveDriver driver(family.service, family.toml());
    for (const SentPacket& packet : recording.packets) send(driver, family, packet);
    driver.finish();
    const Offline offline = import(family.sensor, recording.packets);
    CHECK(offline.sweeps.size() >= 2);
    CHECK(driver.published["RAW_SWEEP"] == offline.sweeps);
    CHECK(driver.published["RAW_IMU"] == offline.imu);
    CHECK(driver.state() != health_t::STATE_DEGRADED);
  }
}

TEST_CASE("garbage and a second sensor are counted and change nothing", "[lidar_driver]") {
  std::mt19937_64 random(2);
  DriverFixture fixture;
  for (const Family& family : three_makers(fixture, one_of_each_family())) {
    CAPTURE(family.sensor.name);
    const MadeUpRecording recording = family.sensor.record(2, wall_us(), random);
    LiveDriver driver(family.service, family.toml());
    Sender other("127.0.0.2");
    std::int64_t garbage = 0;
    std::int64_t others = 0;
    for (const SentPacket& packet : recording.packets) {
      send(driver, family, packet);
      if (packet.port != family.ports[0]) continue;
      if (random() % 4 == 0) {
        other.send(driver.ports[0], packet.bytes);
        ++others;
      }
      if (random() % 4 != 0) continue;
      Message bad = packet.bytes;
      bad.resize(random() % 2 == 0 ? bad.size() / 2 : bad.size() + 1);
      driver.send(bad);
      ++garbage;
    }
    driver.finish();
    CHECK(driver.published["RAW_SWEEP"] == import(family.sensor, recording.packets).sweeps);
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kTooShort) > garbage / 4);
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kTooShort) +
              driver.count("RAW_SWEEP", wire::Reason::kTooLong) ==
          garbage);
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kInconsistent) == others);
  }
}

TEST_CASE("silence, lost packets and a foreign clock are reported", "[lidar_driver]") {
  std::mt19937_64 random(3);
  DriverFixture fixture;
  for (const Family& family : three_makers(fixture, one_of_each_family())) {
    CAPTURE(family.sensor.name);
    LiveDriver driver(family.service, family.toml());
    driver.settle();
    driver.now_us += 1'100'000;
    driver.settle();
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kSensorSilent) == 1);
    CHECK(driver.state() == health_t::STATE_DEGRADED);

    // An hour after power-on, and a tenth of a turn is lost.
    constexpr model::Utime kSincePowerOn = 3'600'000'000;
    auto packets = family.sensor.record(2, kSincePowerOn, random).packets;
    packets.erase(packets.begin() + static_cast<long>(packets.size() / 2),
                  packets.begin() + static_cast<long>(packets.size() / 2 + packets.size() / 20));
    for (const SentPacket& packet : packets) send(driver, family, packet);
    driver.settle();
    CHECK(std::ranges::count(driver.log, "sensor_speaks", &log_t::code) == 1);
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kPartsMissing) >= 1);
    driver.now_us += 999'000;
    driver.send(packets.back().bytes);
    driver.settle();
    driver.now_us += 2'000;
    driver.settle();
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kClockJump) >= 1);
  }
}

TEST_CASE("stamps are those of the reception where they are asked for", "[lidar_driver]") {
  std::mt19937_64 random(4);
  DriverFixture fixture;
  for (const Family& family : three_makers(fixture, one_of_each_family())) {
    CAPTURE(family.sensor.name);
    // Three minutes behind: a clock of the time of day, but for its error.
    const auto recording = family.sensor.record(2, wall_us() - 180'000'000, random);
    LiveDriver by_sensor(family.service, family.toml());
    LiveDriver by_arrival(family.service, family.toml() + "[time]\nsource = \"received\"\n");
    for (LiveDriver* driver : {&by_sensor, &by_arrival}) {
      for (const SentPacket& packet : recording.packets) send(*driver, family, packet);
      driver->finish();
    }
    const auto stamp = [](LiveDriver& driver) {
      return sweep_of(driver.published["RAW_SWEEP"].at(0)).utime;
    };
    CHECK(std::abs(stamp(by_sensor) - wall_us() + 180'000'000) < 60'000'000);
    CHECK(std::abs(stamp(by_arrival) - wall_us()) < 60'000'000);
    for (const Message& message : by_arrival.published["RAW_IMU"])
      CHECK(std::abs(wire::decode_message<model::ImuSample>(message).value().utime - wall_us()) <
            60'000'000);
  }
}

TEST_CASE("another unit's samples may take the place of the laser's own", "[lidar_driver]") {
  std::mt19937_64 random(5);
  DriverFixture fixture;
  for (const Family& family : three_makers(fixture, one_of_each_family())) {
    if (family.ports.size() < 2) continue;
    CAPTURE(family.sensor.name);
    LiveDriver driver(family.service, family.toml() + "[imu]\nis_published = false\n");
    for (const SentPacket& packet : family.sensor.record(1, wall_us(), random).packets)
      send(driver, family, packet);
    driver.finish();
    CHECK(driver.published["RAW_IMU"].empty());
    CHECK(!driver.published["RAW_SWEEP"].empty());
  }
}

TEST_CASE("drivers refuse configurations that cannot work by key", "[lidar_driver]") {
  const auto problem = [](const bus::Service& service, const std::string& toml) -> std::string {
    bus::MemoryBus bus;
    try {
      const bus::HostedService hosted(service, bus, bus::no_clock(), toml, "test.toml");
    } catch (const bus::ConfigurationError& error) {
      return error.what();
    }
    return {};
  };
  const auto ouster = ouster_driver::ouster_driver_service();
  const auto hesai = hesai_driver::hesai_driver_service();
  CHECK(problem(ouster, "").starts_with("sensor.metadata_file: "));
  CHECK(problem(ouster, "[sensor]\nmetadata_file = \"/no/such.json\"\n")
            .starts_with("sensor.metadata_file: "));
  CHECK(problem(hesai, "").empty());
  CHECK(problem(hesai, "[sensor]\nangle_file = \"/no/such.csv\"\n")
            .starts_with("sensor.angle_file: "));
  for (const auto& service : {ouster, hesai, livox_driver::livox_driver_service()})
    CHECK(problem(service, "[network]\nbind_address = \"here\"\n")
              .starts_with("network.bind_address: \"here\""));
}
