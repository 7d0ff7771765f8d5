// The drivers of all makers as processes: on a bus of their own, with a port that is taken, and at
// their end.
#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>

#include "common/bus/live_bus.hpp"
#include "deploy/launch/child_process.hpp"
#include "services/lidar_driver/udp_socket.hpp"
#include "tests/lidar_driver/driver_family.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

using SteadyClock = std::chrono::steady_clock;

/// Another port for every process.
std::string private_url() {
  static int calls = 0;
  const int port = 30'000 + (::getpid() * 7 + 1000 * calls++) % 20'000;
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
}

/// A driver's executable, and what it says.
class DriverProcess {
 public:
  DriverProcess(const Family& family, const std::vector<int>& listened) {
    bus_->subscribe("RAW_SWEEP", 0, [this](const bus::BusMessage& m) {
      sweeps.emplace_back(m.bytes.begin(), m.bytes.end());
    });
    bus_->subscribe("LOG", 0, [this](const bus::BusMessage& m) {
      const auto line = wire::decode_message<log_t>(m.bytes);
      if (line && line->code == "listens") ports = ports_in(line->text);
    });
    std::ofstream(directory_ / "driver.toml") << "[network]\nbind_address = \"127.0.0.1\"\n"
                                              << family.toml(listened);
    std::string executable = "understory-" + family.service.name;
    std::ranges::replace(executable, '_', '-');
    // The shell gives its place to the driver: one process, one number.
    process_ = launch::ChildProcess::start(
        {"/bin/sh",
         {"-c", R"(exec "$0" "$@" 2> "$ERRORS")", UNDERSTORY_BIN "/" + executable, "--config",
          directory_ / "driver.toml", "--lcm-url", url_},
         {"ERRORS=" + error_file()}});
  }
  ~DriverProcess() {
    if (!ending_) process_->signal(SIGKILL);
  }
  DriverProcess(const DriverProcess&) = delete;
  DriverProcess& operator=(const DriverProcess&) = delete;

  /// Handles messages until the condition holds; false after half a minute.
  template <class Condition>
  bool wait_until(Condition condition) {
    const auto end = SteadyClock::now() + std::chrono::seconds(30);
    while (!condition()) {
      if (SteadyClock::now() > end) return false;
      listen(10);
    }
    return true;
  }
  void listen(int ms) { bus_->handle_one(ms); }
  bool has_ended() {
    if (!ending_) ending_ = process_->ended();
    return ending_.has_value();
  }
  void signal(int number) const { process_->signal(number); }
  launch::Ending ending() const { return ending_.value(); }
  std::string error() const {
    std::ifstream file(error_file());
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::vector<Message> sweeps;
  std::vector<int> ports;

 private:
  std::string error_file() const { return directory_ / "errors"; }

  TemporaryDirectory directory_;
  std::string url_ = private_url();
  std::unique_ptr<bus::Bus> bus_ = bus::make_live_bus(url_);
  std::optional<launch::ChildProcess> process_;
  std::optional<launch::Ending> ending_;
};

}  // namespace

TEST_CASE("a port that is taken ends every driver with status 1 and is named", "[lidar_driver]") {
  const lidar_driver::UdpSocket taken("127.0.0.1", 0, 65536);
  DriverFixture fixture;
  for (const Family& family : fixture.families(one_of_each_family())) {
    for (std::size_t port = 0; port < family.port_keys.size(); ++port) {
      CAPTURE(family.service.name, family.port_keys[port]);
      std::vector<int> listened(family.port_keys.size(), 0);
      listened[port] = taken.port();
      DriverProcess driver(family, listened);
      REQUIRE(driver.wait_until([&] { return driver.has_ended(); }));
      CHECK(driver.ending().text() == "exited with status 1");
      CHECK(driver.error() == fmt::format("{}: UDP port {} of 127.0.0.1: Address already in use\n",
                                          family.service.name, taken.port()));
    }
  }
}

TEST_CASE("every driver publishes turns, and SIGTERM ends it within a second with status 0",
          "[lidar_driver]") {
  std::mt19937_64 random(6);
  DriverFixture fixture;
  for (const Family& family : fixture.families(one_of_each_family())) {
    CAPTURE(family.service.name);
    DriverProcess driver(family, {});
    REQUIRE(driver.wait_until([&] { return !driver.ports.empty() || driver.has_ended(); }));
    REQUIRE(driver.ports.size() == family.ports.size());

    const MadeUpRecording recording = family.sensor.record(2, wall_us(), random);
    Sender sensor;
    for (const SentPacket& packet : recording.packets) {
      const auto port = std::ranges::find(family.ports, packet.port) - family.ports.begin();
      sensor.send(driver.ports[static_cast<std::size_t>(port)], packet.bytes);
      driver.listen(1);
    }
    std::vector<Message> expected = import(family.sensor, recording.packets).sweeps;
    REQUIRE(driver.wait_until([&] { return 2 * driver.sweeps.size() >= expected.size(); }));
    expected.resize(std::min(expected.size(), driver.sweeps.size()));
    CHECK(driver.sweeps == expected);

    const auto signalled = SteadyClock::now();
    driver.signal(SIGTERM);
    REQUIRE(driver.wait_until([&] { return driver.has_ended(); }));
    CHECK(SteadyClock::now() - signalled < std::chrono::seconds(1));
    CHECK(driver.ending().text() == "exited with status 0");
    CHECK(driver.error().empty());
  }
}
