// Packets through a real socket: what comes out must be what the offline decoder gives, byte for
// byte, whatever else comes in.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "common/io/packet_capture.hpp"
#include "common/io/velodyne_fixes.hpp"
#include "tests/data.hpp"
#include "tests/io/log_fixture.hpp"
#include "tests/io/velodyne_packets.hpp"
#include "tests/velodyne_driver/live_velodyne.hpp"

using namespace understory;
using namespace understory::velodyne_driver;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

struct Laser {
  std::string model;
  test::PacketMaker maker;
};

std::vector<Laser> lasers() {
  return {
      {"vlp16", {.azimuth = 35000}},
      {"vlp16", {.dual = true, .azimuth = 35000}},
      {"vlp32c", {.product = 0x28, .azimuth = 35000, .azimuth_step = 20}},
      {"hdl32e", {.product = 0x21, .azimuth = 35000, .azimuth_step = 20}},
      {"hdl64e",
       {.hdl64 = true, .product = 0, .azimuth = 35000, .azimuth_step = 20, .packet_us = 288.0}}};
}

std::vector<test::Packet> packets_of(test::PacketMaker maker, int count) {
  std::vector<test::Packet> packets;
  packets.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) packets.push_back(maker.next());
  return packets;
}

io::VelodyneCalibration calibration_of(const std::string& model) {
  if (model == "hdl64e") return io::parse_hdl64_calibration(test::hdl64_yaml(), "db.yaml");
  return velodyne_calibration(io::velodyne_model(model).value());
}

/// The same packets offline, in the hour in which the live ones came.
std::vector<test::Message> offline(const std::string& model,
                                   const std::vector<test::Packet>& packets,
                                   const std::vector<test::Message>& live) {
  REQUIRE(!live.empty());
  test::OfflineDriver driver(calibration_of(model));
  for (const test::Packet& packet : packets) driver.add(packet, sweep_of(live.front()).utime);
  driver.finish();
  return driver.parts;
}

/// A packet that is none of a VLP-16.
test::Packet garbage(const test::Packet& good, std::mt19937_64& random) {
  test::Packet packet = good;
  switch (random() % 4) {
    case 0:
      packet.resize(random() % 3000);
      if (packet.size() == io::kVelodyneDataBytes) packet.pop_back();
      break;
    case 1:
      packet.back() = 0x21;
      break;
    case 2:
      packet[100 * (random() % 12)] ^= static_cast<std::uint8_t>(1 + random() % 255);
      break;
    default:
      packet[100 * (random() % 12) + 3] = 0xFF;
  }
  return packet;
}

}  // namespace

TEST_CASE("live sweeps are those of the offline decoder, byte for byte", "[velodyne_driver]") {
  const test::TemporaryDirectory directory;
  std::ofstream(directory / "db.yaml") << test::hdl64_yaml();
  for (const Laser& laser : lasers()) {
    CAPTURE(laser.model, laser.maker.dual);
    std::string toml = "[sensor]\nmodel = \"" + laser.model + "\"\n";
    if (laser.maker.hdl64)
      toml += "calibration_file = \"" + (directory / "db.yaml").string() + "\"\n";
    test::LiveVelodyne driver(toml);
    const auto packets = packets_of(laser.maker, 500);
    for (const test::Packet& packet : packets) driver.send(packet);
    driver.finish();
    const auto& live = driver.published["RAW_SWEEP"];
    CHECK(live.size() > 5);
    CHECK(live == offline(laser.model, packets, live));
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kPartsMissing) == 0);
    CHECK(driver.count("RAW_SWEEP", wire::Reason::kQueueFull) == 0);
  }
}

TEST_CASE("a recorded capture, sent again, gives the sweeps and fixes of its import",
          "[velodyne_driver][recorded]") {
  const fs::path capture_file = test::recording("lidar_packets/velodyne_vlp16_gps.pcap");
  test::LiveVelodyne driver;
  test::Sender positions;
  std::vector<test::Packet> data;
  std::vector<model::GnssFix> fixes;
  io::VelodyneFixes offline_fixes;
  io::PacketCapture capture(capture_file);
  while (const auto packet = capture.next()) {
    if (packet->port == io::kVelodynePositionPort) {
      positions.send(driver.position_port, packet->payload);
      const auto position = io::parse_velodyne_position(packet->payload);
      const auto fix =
          position ? offline_fixes.add(*position, packet->utime) : std::optional<model::GnssFix>();
      if (fix) fixes.push_back(*fix);
    } else if (packet->port == io::kVelodyneDataPort) {
      driver.send(packet->payload);
      data.push_back(packet->payload);
    }
  }
  driver.finish();
  const auto& live = driver.published["RAW_SWEEP"];
  CHECK(data.size() == 293);
  CHECK(live.size() > 5);
  CHECK(live == offline("vlp16", data, live));
  CHECK(driver.published["RAW_GNSS"].size() == fixes.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const auto fix = wire::decode_message<model::GnssFix>(driver.published["RAW_GNSS"][i]).value();
    CHECK(fix.east_north_m == fixes[i].east_north_m);
    CHECK(fix.velocity_mps == fixes[i].velocity_mps);
  }
}

TEST_CASE("garbage among the packets is counted and changes nothing", "[velodyne_driver]") {
  std::mt19937_64 random(5);
  test::LiveVelodyne driver;
  const auto packets = packets_of({.azimuth = 35000}, 250);
  std::int64_t sent = 0;
  for (const test::Packet& packet : packets) {
    for (auto count = random() % 3; count > 0; --count, ++sent)
      driver.send(garbage(packet, random));
    driver.send(packet);
  }
  driver.finish();
  const auto& live = driver.published["RAW_SWEEP"];
  CHECK(live.size() > 5);
  CHECK(live == offline("vlp16", packets, live));
  CHECK(sent > 100);
  const auto count = [&](wire::Reason reason) { return driver.count("RAW_SWEEP", reason); };
  CHECK(count(wire::Reason::kTooShort) > 10);
  CHECK(count(wire::Reason::kTooLong) > 10);
  CHECK(count(wire::Reason::kWrongType) > 10);
  CHECK(count(wire::Reason::kInconsistent) > 10);
  CHECK(count(wire::Reason::kTooShort) + count(wire::Reason::kTooLong) +
            count(wire::Reason::kWrongType) + count(wire::Reason::kInconsistent) ==
        sent);
  CHECK(driver.state() == health_t::STATE_DEGRADED);
}

TEST_CASE("position packets that are none are counted", "[velodyne_driver]") {
  test::LiveVelodyne driver;
  test::Sender sender;
  test::Packet packet(io::kVelodynePositionBytes, 0);
  sender.send(driver.position_port, packet);  // no receiver at the sensor: nothing is wrong
  sender.send(driver.position_port, test::Packet(511, 0));
  sender.send(driver.position_port, test::Packet(2500, 0));
  const std::string sentence = "$GPRMC,081801,A,3642.7250,N,00426.3880,W,0.1,9.0,210116,,,A*00";
  std::ranges::copy(sentence, packet.begin() + 206);
  sender.send(driver.position_port, packet);
  driver.finish();
  CHECK(driver.count("RAW_GNSS", wire::Reason::kTooShort) == 1);
  CHECK(driver.count("RAW_GNSS", wire::Reason::kTooLong) == 1);
  CHECK(driver.count("RAW_GNSS", wire::Reason::kInconsistent) == 1);
  CHECK(driver.published["RAW_GNSS"].empty());
}

TEST_CASE("a silent sensor is told for as long as it lasts", "[velodyne_driver]") {
  test::LiveVelodyne driver;
  const auto silences = [&] { return driver.count("RAW_SWEEP", wire::Reason::kSensorSilent); };
  driver.settle();
  driver.now_us += 990'000;
  driver.settle();
  CHECK(silences() == 0);
  driver.now_us += 20'000;
  driver.settle();
  CHECK(silences() == 1);
  CHECK(driver.state() == health_t::STATE_DEGRADED);
  driver.now_us += 10'000'000;
  driver.settle();
  CHECK(silences() == 2);
  CHECK(driver.state() == health_t::STATE_DEGRADED);

  driver.send(test::Packet(700, 1));  // garbage is no sign of life
  driver.now_us += 1'000'000;
  driver.settle();
  CHECK(silences() == 3);
  driver.send(test::PacketMaker{}.next());
  driver.settle();
  driver.now_us += 900'000;
  driver.settle();
  CHECK(silences() == 3);
  CHECK(std::ranges::count(driver.log, "sensor_speaks", &log_t::code) == 1);
}

TEST_CASE("packets of a second sensor are not mixed in", "[velodyne_driver]") {
  test::LiveVelodyne driver;
  test::Sender other("127.0.0.2");
  test::PacketMaker strange{.azimuth = 12000, .distance = 900};
  const auto packets = packets_of({.azimuth = 35000}, 250);
  for (const test::Packet& packet : packets) {
    driver.send(packet);
    other.send(driver.data_port, strange.next());
  }
  driver.finish();
  CHECK(driver.count("RAW_SWEEP", wire::Reason::kInconsistent) == 250);
  const auto& live = driver.published["RAW_SWEEP"];
  CHECK(live == offline("vlp16", packets, live));
}

TEST_CASE("packets that the kernel throws away are counted", "[velodyne_driver]") {
  test::LiveVelodyne driver("receive_buffer_bytes = 8192\n");
  test::Sender sensor;
  test::PacketMaker maker;
  for (int i = 0; i < 300; ++i) sensor.send(driver.data_port, maker.next());
  driver.settle();
  driver.send(maker.next());  // the kernel tells with the next one
  driver.finish();
  CHECK(driver.count("RAW_SWEEP", wire::Reason::kQueueFull) >= 1);
  long taken = 0;
  long thrown_away = 0;
  const auto& text = driver.log.back().text;
  REQUIRE(std::sscanf(text.c_str(), "data packets %ld", &taken) == 1);
  REQUIRE(std::sscanf(text.substr(text.find("thrown")).c_str(), "thrown away by the kernel %ld",
                      &thrown_away) == 1);
  CHECK(thrown_away > 200);
  CHECK(taken + thrown_away == 301);
}

TEST_CASE("a turn across a pause of the sensor is not published", "[velodyne_driver]") {
  test::LiveVelodyne driver;
  test::PacketMaker maker{.azimuth = 35000};
  for (int i = 0; i < 120; ++i) driver.send(maker.next());
  maker.time_us += 700'000;
  for (int i = 0; i < 250; ++i) driver.send(maker.next());
  driver.finish();
  CHECK(driver.count("RAW_SWEEP", wire::Reason::kPartsMissing) == 1);
  const auto& live = driver.published["RAW_SWEEP"];
  CHECK(live.size() > 5);
  for (const test::Message& message : live) {
    for (const model::SweepPoint& point : sweep_of(message).points) CHECK(point.time_s < 0.11F);
  }
}

TEST_CASE("a sensor's clock that is not the computer's is told, or made up for",
          "[velodyne_driver]") {
  const auto now = [] {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  test::PacketMaker maker{.azimuth = 35000};
  maker.time_us = static_cast<double>((now() + 900'000'000) % 3'600'000'000);
  const auto packets = packets_of(maker, 150);
  test::LiveVelodyne by_sensor;
  test::LiveVelodyne by_arrival("[time]\nsource = \"received\"\n");
  for (test::LiveVelodyne* driver : {&by_sensor, &by_arrival}) {
    for (const test::Packet& packet : packets) driver->send(packet);
    driver->settle();
    driver->now_us += 999'000;
    driver->send(packets.back());
    driver->settle();
    driver->now_us += 2'000;
    driver->finish();
  }
  const auto stamp = [](test::LiveVelodyne& driver) {
    return sweep_of(driver.published["RAW_SWEEP"].at(0)).utime;
  };
  CHECK(by_sensor.count("RAW_SWEEP", wire::Reason::kClockJump) == 1);
  CHECK(by_arrival.count("RAW_SWEEP", wire::Reason::kClockJump) == 0);
  CHECK(std::abs(stamp(by_sensor) - now() - 900'000'000) < 100'000'000);
  CHECK(std::abs(stamp(by_arrival) - now()) < 100'000'000);
}
