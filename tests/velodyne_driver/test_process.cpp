// The driver as a process: on the bus, with a port that is taken, and at its end.
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "common/bus/live_bus.hpp"
#include "common/bus/parameter_table.hpp"
#include "deploy/launch/child_process.hpp"
#include "services/lidar_driver/udp_socket.hpp"
#include "tests/io/log_fixture.hpp"
#include "tests/io/velodyne_packets.hpp"
#include "tests/velodyne_driver/live_velodyne.hpp"

using namespace understory;
using namespace understory::velodyne_driver;
using namespace understory::test;

namespace {

std::string configured(const std::string& toml) {
  bus::MemoryBus bus;
  try {
    const bus::HostedService hosted(velodyne_driver_service(), bus, bus::no_clock(), toml,
                                    "test.toml");
  } catch (const bus::ConfigurationError& error) {
    return error.what();
  }
  return {};
}

/// The process, its configuration and what it says on a bus of its own.
struct Running {
  test::TemporaryDirectory directory;
  std::string url =
      "udpm://239.255.76.67:" + std::to_string(30'000 + ::getpid() * 7 % 20'000) + "?ttl=0";
  std::unique_ptr<bus::Bus> bus = bus::make_live_bus(url);
  std::vector<test::Message> sweeps;
  int port = 0;

  Running() {
    std::ofstream(directory / "driver.toml") << "[network]\nbind_address = \"127.0.0.1\"\n"
                                                "data_port = 0\nposition_port = 0\n";
    bus->subscribe("RAW_SWEEP", 0, [this](const bus::BusMessage& m) {
      sweeps.emplace_back(m.bytes.begin(), m.bytes.end());
    });
    bus->subscribe("LOG", 0, [this](const bus::BusMessage& m) {
      const auto line = wire::decode_message<log_t>(m.bytes);
      if (line && line->code == "listens")
        std::sscanf(line->text.c_str(), "127.0.0.1: data port %d", &port);
    });
  }
  template <class Condition>
  bool wait_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      bus->handle_one(10);
    }
    return true;
  }
  /// How a process ends of which that is expected; it is told once.
  launch::Ending end_of(const launch::ChildProcess& process) {
    std::optional<launch::Ending> ending;
    const bool has_ended = wait_until([&] { return (ending = process.ended()).has_value(); });
    if (!has_ended) process.signal(SIGKILL);
    REQUIRE(has_ended);
    return *ending;
  }
};

}  // namespace

TEST_CASE("configurations that cannot work are refused by key", "[velodyne_driver]") {
  CHECK(configured("").empty());
  CHECK(configured("[sensor]\nmodel = \"hdl64e\"\n").starts_with("sensor.calibration_file"));
  CHECK(configured("[sensor]\nmodel = \"hdl64e\"\ncalibration_file = \"/no/such.xml\"\n")
            .starts_with("sensor.calibration_file: "));
  CHECK(configured("[sensor]\ncalibration_file = \"a.xml\"\n")
            .starts_with("sensor.calibration_file"));
  CHECK(configured("[network]\nbind_address = \"localhost\"\n")
            .starts_with("network.bind_address: \"localhost\""));
  CHECK(configured("[network]\nsensor_address = \"1.2.3\"\n")
            .starts_with("network.sensor_address: \"1.2.3\""));
}

TEST_CASE("a port that is taken is named", "[velodyne_driver]") {
  const lidar_driver::UdpSocket taken("127.0.0.1", 0, 65536);
  const std::string port = std::to_string(taken.port());
  std::string problem;
  try {
    const lidar_driver::UdpSocket second("127.0.0.1", taken.port(), 65536);
  } catch (const std::runtime_error& error) {
    problem = error.what();
  }
  CHECK(problem.starts_with("UDP port " + port + " of 127.0.0.1: "));

  const test::TemporaryDirectory directory;
  std::ofstream(directory / "driver.toml")
      << "[network]\nbind_address = \"127.0.0.1\"\nposition_port = 0\ndata_port = " << port << '\n';
  Running other;
  const auto process =
      launch::ChildProcess::start({UNDERSTORY_VELODYNE_DRIVER,
                                   {"--config", directory / "driver.toml", "--lcm-url", other.url},
                                   {}});
  const launch::Ending ending = other.end_of(process);
  CHECK(ending.known);
  CHECK(ending.exit_code == 1);
}

TEST_CASE("the process publishes turns, and SIGTERM ends it with status 0", "[velodyne_driver]") {
  Running running;
  const auto process = launch::ChildProcess::start(
      {UNDERSTORY_VELODYNE_DRIVER,
       {"--config", running.directory / "driver.toml", "--lcm-url", running.url},
       {}});
  REQUIRE(running.wait_until([&] { return running.port > 0 || process.ended(); }));
  REQUIRE(running.port > 0);
  test::Sender sensor;
  test::PacketMaker maker{.azimuth = 35000};
  test::OfflineDriver offline(velodyne_calibration(io::VelodyneModel::kVlp16));
  std::vector<test::Packet> packets;
  for (int i = 0; i < 250; ++i) {
    packets.push_back(maker.next());
    sensor.send(running.port, packets.back());
    running.bus->handle_one(1);
  }
  REQUIRE(running.wait_until([&] { return running.sweeps.size() >= 16; }));
  for (const test::Packet& packet : packets)
    offline.add(packet, sweep_of(running.sweeps.front()).utime);
  REQUIRE(offline.parts.size() >= running.sweeps.size());
  offline.parts.resize(running.sweeps.size());
  CHECK(running.sweeps == offline.parts);

  process.signal(SIGTERM);
  const launch::Ending ending = running.end_of(process);
  CHECK(ending.known);
  CHECK(ending.exit_code == 0);
  CHECK(ending.signal == 0);
}
