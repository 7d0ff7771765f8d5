// A driver as its process has it, with a socket on loopback, and a sensor that sends to it.
#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/device.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "understory/log_t.hpp"

namespace understory::test {

using Message = std::vector<std::uint8_t>;

/// Sends from an address of the loopback network.
class Sender {
 public:
  explicit Sender(const std::string& address = "127.0.0.1")
      : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in name = loopback(0);
    REQUIRE(::inet_pton(AF_INET, address.c_str(), &name.sin_addr) == 1);
    REQUIRE(::bind(file_, reinterpret_cast<const sockaddr*>(&name), sizeof(name)) == 0);
  }
  ~Sender() { ::close(file_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void send(int port, std::span<const std::uint8_t> bytes) {
    const sockaddr_in name = loopback(port);
    const auto sent = ::sendto(file_, bytes.data(), bytes.size(), 0,
                               reinterpret_cast<const sockaddr*>(&name), sizeof(name));
    REQUIRE(sent == static_cast<ssize_t>(bytes.size()));
  }

 private:
  static sockaddr_in loopback(int port) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    name.sin_port = htons(static_cast<std::uint16_t>(port));
    return name;
  }
  int file_;
};

/// The ports of a driver's line "listens".
inline std::vector<int> ports_in(const std::string& text) {
  constexpr std::string_view kPort = " port ";
  std::vector<int> ports;
  for (auto at = text.find(kPort); at != std::string::npos; at = text.find(kPort, at + 1))
    ports.push_back(std::atoi(text.c_str() + at + kPort.size()));
  return ports;
}

class LiveDriver {
 public:
  /// `toml`: its configuration but for bind_address.
  LiveDriver(const bus::Service& service, const std::string& toml)
      : hosted_(service, bus_, clock(), "[network]\nbind_address = \"127.0.0.1\"\n" + toml,
                "test.toml"),
        device_(dynamic_cast<bus::Device&>(hosted_.adapter())) {
    device_.open();
    hosted_.node().connect();
    for (const log_t& line : log) {
      if (line.code != "listens") continue;
      ports = ports_in(line.text);
    }
    REQUIRE(!ports.empty());
    for (const int port : ports) REQUIRE(port > 0);
  }

  /// Lets it work until nothing waits any more.
  void settle() {
    std::vector<pollfd> files;
    for (const int file : device_.file_descriptors()) files.push_back({file, POLLIN, 0});
    do {
      device_.attend(now_us);
    } while (device_.wait_ms() == 0 || ::poll(files.data(), files.size(), 20) > 0);
  }
  void send(std::span<const std::uint8_t> packet, std::size_t port = 0) {
    sensor_.send(ports[port], packet);
    if (++sent_ % 20 == 0) settle();
  }
  void finish() {
    settle();
    hosted_.adapter().finish();
  }
  std::int64_t count(const std::string& channel, wire::Reason reason) {
    return hosted_.node().monitor().count_of(channel, reason);
  }
  std::int8_t state() { return hosted_.node().monitor().state(); }

  std::vector<int> ports;               ///< In the order of its settings.
  std::int64_t now_us = 1'000'000'000;  ///< Monotonic.
  std::map<std::string, std::vector<Message>> published;
  std::vector<log_t> log;

 private:
  bus::Clock clock() {
    return {[this] { return now_us; }, [this] { return now_us; }};
  }
  void keep(const bus::BusMessage& message) {
    if (message.channel == "LOG") {
      log.push_back(wire::decode_message<log_t>(message.bytes).value());
    } else {
      published[std::string(message.channel)].emplace_back(message.bytes.begin(),
                                                           message.bytes.end());
    }
  }

  bus::MemoryBus bus_{bus::MemoryBus::Queues::kBounded,
                      [this](const bus::BusMessage& m) { keep(m); }};
  bus::HostedService hosted_;
  bus::Device& device_;
  Sender sensor_;
  int sent_ = 0;
};

inline model::PointSweep sweep_of(const Message& message) {
  return wire::decode_message<model::PointSweep>(message).value();
}

}  // namespace understory::test
