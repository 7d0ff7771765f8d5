// The live bus on the wire: beside liblcm in both directions, under hostile datagrams, and where
// the port is somebody else's.
#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>

#include "common/bus/bulk_group.hpp"
#include "common/bus/live_bus.hpp"
#include "common/bus/node.hpp"
#include "common/bus/own_addresses.hpp"
#include "common/bus/port_owner.hpp"
#include "common/bus/process_memory.hpp"
#include "common/bus/udpm_reassembly.hpp"
#include "common/bus/udpm_receiver.hpp"
#include "common/bus/udpm_url.hpp"
#include "tests/bus/hostile_datagrams.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

constexpr std::uint32_t kGroup = 0xEFFF4C44;  // 239.255.76.68

/// A port of this test process's own, not that of test_bus.cpp.
std::uint16_t own_port() { return static_cast<std::uint16_t>(40000 + ::getpid() % 20000); }

std::string own_url() {
  return "udpm://239.255.76.68:" + std::to_string(own_port()) + "?ttl=0&recv_buf_size=4194304";
}

/// A socket that sends given bytes to the group, also hostile ones.
class RawSender {
 public:
  RawSender() : file_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    const unsigned char ttl = 0;
    ::setsockopt(file_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
  }
  ~RawSender() { ::close(file_); }
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;

  void send(const Datagram& datagram) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(kGroup);
    to.sin_port = htons(own_port());
    ::sendto(file_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&to),
             sizeof(to));
  }

 private:
  int file_;
};

/// A program that takes the port and does not share it.
class PortThief {
 public:
  PortThief() : file_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_port = htons(own_port());
    REQUIRE(::bind(file_, reinterpret_cast<sockaddr*>(&any), sizeof(any)) == 0);
  }
  ~PortThief() { ::close(file_); }
  PortThief(const PortThief&) = delete;
  PortThief& operator=(const PortThief&) = delete;

 private:
  int file_;
};

Datagram random_bytes(std::size_t size) {
  std::mt19937 random(static_cast<unsigned>(size));
  Datagram bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

/// Handles until it is done, at most five seconds.
template <class IsDone>
void handle_until(Bus& bus, const IsDone& is_done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (!is_done() && std::chrono::steady_clock::now() < end) bus.handle_one(50);
}

/// Sizes around the ends of liblcm's short messages and of its fragments, and large ones.
std::vector<std::size_t> sizes_to_try() {
  return {0, 1, 1390, 1400, 1500, 65480, 65500, 66000, 300000, 3000000};
}

/// A sink that notes channels, and holds the receiving thread with the first message until go_on().
class HoldingSink {
 public:
  void operator()(std::string_view channel) {
    std::unique_lock lock(mutex_);
    channels_.emplace_back(channel);
    changed_.notify_all();
    changed_.wait(lock, [&] { return goes_on_; });
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    goes_on_ = true;
    changed_.notify_all();
  }
  /// Waits up to 10 s for so many.
  std::vector<std::string> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(10), [&] { return channels_.size() >= count; });
    return channels_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> channels_;
  bool goes_on_ = false;
};

}  // namespace

TEST_CASE("what liblcm publishes, small and large, comes in whole") {
  LiveBus bus(own_url());
  std::vector<Datagram> got;
  bus.subscribe("FROM_LIBLCM", 0, [&](const BusMessage& message) {
    got.emplace_back(message.bytes.begin(), message.bytes.end());
    CHECK(message.received_us > 1500000000000000);
  });

  lcm_t* lcm = lcm_create(own_url().c_str());
  REQUIRE(lcm != nullptr);
  std::vector<Datagram> sent;
  for (const std::size_t size : sizes_to_try()) {
    sent.push_back(random_bytes(size));
    REQUIRE(lcm_publish(lcm, "FROM_LIBLCM", sent.back().data(), static_cast<unsigned>(size)) == 0);
    handle_until(bus, [&] { return got.size() == sent.size(); });
  }
  lcm_destroy(lcm);

  CHECK(got == sent);
  CHECK(bus.refused_datagrams().total() == 0);
}

TEST_CASE("what the live bus publishes, liblcm receives") {
  lcm_t* lcm = lcm_create(own_url().c_str());
  REQUIRE(lcm != nullptr);
  std::vector<Datagram> got;
  lcm_subscribe(
      lcm, "TO_LIBLCM",
      [](const lcm_recv_buf_t* buffer, const char*, void* to) {
        const auto* data = static_cast<const std::uint8_t*>(buffer->data);
        static_cast<std::vector<Datagram>*>(to)->emplace_back(data, data + buffer->data_size);
      },
      &got);

  LiveBus bus(own_url());
  std::vector<Datagram> sent;
  for (const std::size_t size : sizes_to_try()) {
    sent.push_back(random_bytes(size));
    CHECK_FALSE(bus.publish("TO_LIBLCM", sent.back()));
    for (int i = 0; i < 50 && got.size() < sent.size(); ++i) lcm_handle_timeout(lcm, 100);
  }
  lcm_destroy(lcm);
  CHECK(got == sent);
}

TEST_CASE("who only sends joins no group; all channels can be heard") {
  LiveBus sender(own_url());
  CHECK_FALSE(sender.publish("ONE", random_bytes(10)));
  CHECK(sender.file_descriptor() >= 0);
  LiveBus listener(own_url());
  std::vector<std::string> channels;
  listener.subscribe_all(0, [&](const BusMessage& message) {
    channels.emplace_back(message.channel);
    CHECK(message.bytes.size() == 10);
  });

  for (const char* channel : {"ONE", "A_LONG_NAME_OF_A_CHANNEL", "TWO"}) {
    CHECK_FALSE(sender.publish(channel, random_bytes(10)));
  }
  handle_until(listener, [&] { return channels.size() == 3; });
  CHECK(channels == std::vector<std::string>{"ONE", "A_LONG_NAME_OF_A_CHANNEL", "TWO"});
  CHECK(listener.dropped_of_all() == 0);
  CHECK_FALSE(sender.handle_one(0));
}

TEST_CASE("after a pause messages of both groups come in the order in which they were received") {
  HoldingSink sink;
  UdpmReceiver receiver([](std::string_view) { return true; },
                        [&](std::string_view channel, std::span<const std::uint8_t>, std::int64_t) {
                          sink(channel);
                        });
  const std::string bulk_url = bulk_lcm_url(own_url());
  receiver.join(parse_udpm_url(own_url()), own_url());
  receiver.join(parse_udpm_url(bulk_url), bulk_url);
  LiveBus sender(own_url(), Groups::kWithBulk);

  std::vector<std::string> sent = {"RAW_IMU"};
  CHECK_FALSE(sender.publish("RAW_IMU", std::vector<std::uint8_t>(8)));
  REQUIRE(sink.wait_for(1) == sent);

  // While it is held: sweeps of several fragments among small messages.
  std::mt19937_64 random(7);
  for (int i = 0; i < 150; ++i) {
    const bool is_bulk = random() % 3 == 0;
    sent.emplace_back(is_bulk ? "RAW_SWEEP" : "RAW_IMU_" + std::to_string(i));
    const std::size_t bytes = is_bulk ? random() % 3000 : 8;
    CHECK_FALSE(sender.publish(sent.back(), std::vector<std::uint8_t>(bytes)));
  }
  sink.go_on();
  CHECK(sink.wait_for(sent.size()) == sent);
}

TEST_CASE("the computer's own addresses are known, those of others are not") {
  OwnAddresses own;
  CHECK(own.contains(0x7F000001, 0));
  CHECK(own.contains(0x7F010203, 0));
  CHECK_FALSE(own.contains(0xC0000201, 0));  // 192.0.2.1: for examples only
  CHECK_FALSE(own.contains(0xC0000201, 5'000'000));
  CHECK_FALSE(is_harmful(DatagramFault::kFromOutside));
}

TEST_CASE("the descriptor is readable while a message waits, and only then") {
  LiveBus bus(own_url());
  int heard = 0;
  bus.subscribe("WAKE", 0, [&](const BusMessage&) { ++heard; });
  const auto is_readable = [&](int timeout_ms) {
    pollfd file{bus.file_descriptor(), POLLIN, 0};
    return ::poll(&file, 1, timeout_ms) == 1;
  };
  CHECK_FALSE(is_readable(0));
  bus.publish("WAKE", random_bytes(3));
  CHECK(is_readable(2000));
  handle_until(bus, [&] { return heard == 1; });
  CHECK_FALSE(is_readable(0));
}

TEST_CASE("the live bus survives hostile datagrams, counts them, and hears the next message") {
  LiveBus bus(own_url());
  int heard = 0;
  bus.subscribe("HEALTH", 10, [](const BusMessage&) {});
  bus.subscribe("AFTER", 10, [&](const BusMessage&) { ++heard; });
  const RawSender raw;
  HostileDatagrams hostile(3);
  for (const Datagram& killer : known_killers()) raw.send(killer);
  for (int i = 0; i < 20000; ++i) raw.send(hostile.next());

  for (int i = 0; i < 20 && heard == 0; ++i) {
    raw.send(short_datagram(1, with_nul("AFTER"), random_bytes(10)));
    handle_until(bus, [&] { return !bus.handle_one(50) || heard > 0; });
  }
  CHECK(heard > 0);
  const DatagramFaults faults = bus.refused_datagrams();
  CHECK(faults.count_of(DatagramFault::kOutOfBounds) >= 2);
  CHECK(faults.count_of(DatagramFault::kNoTerminator) >= 1);
}

TEST_CASE(
    "HEALTH counts refused datagrams by reason, and LOG reports it when their number doubles") {
  LiveBus bus(own_url());
  NodeOptions options;
  options.process = "listener";
  Node node(bus, options, system_clock());
  node.connect();
  int heard = 0;
  int lines = 0;
  bus.subscribe("AFTER", 10, [&](const BusMessage&) { ++heard; });
  bus.subscribe("LOG", 10, [&](const BusMessage&) { ++lines; });
  const RawSender raw;
  for (int i = 0; i < 3; ++i) raw.send(short_datagram(0, "HEALTH", {}));
  raw.send(short_datagram(0, with_nul("AFTER"), {}));
  handle_until(bus, [&] { return heard == 1; });

  for (int i = 0; i < 2; ++i) {
    const health_t health = node.health();
    CHECK(health.state == health_t::STATE_DEGRADED);
    CHECK(health.last_error_code == "datagram_no_terminator");
    REQUIRE(health.reasons.size() == 1);
    CHECK(health.reasons[0].reason == "datagram_no_terminator");
    CHECK(health.reasons[0].count == 3);
  }
  handle_until(bus, [&] { return lines == 1; });
  bus.handle_one(50);
  CHECK(lines == 1);
}

TEST_CASE("a port that another program has is refused, and its owner named") {
  const PortThief thief;
  LiveBus bus(own_url());
  std::string message;
  try {
    bus.subscribe("X", 1, [](const BusMessage&) {});
  } catch (const BusError& error) {
    message = error.what();
  }
  INFO(message);
  CHECK(message.find("port " + std::to_string(own_port()) + " is taken by `test_bus`") !=
        std::string::npos);
  CHECK(message.find("process " + std::to_string(::getpid())) != std::string::npos);
}

TEST_CASE("the kernel's table of sockets is read as it is written") {
  const std::string table =
      "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
      "inode ref pointer drops\n"
      " 1103: 444CFFEF:1DF3 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
      "81723 2 0000000000000000 0\n"
      "  104: 00000000000000000000000000000000:0035 00000000000000000000000000000000:0000 07 "
      "00000000:00000000 00:00000000 00000000     0        0 42 2 0 0\n"
      "damaged line\n";
  const auto sockets = parse_udp_table(table);
  REQUIRE(sockets.size() == 2);
  CHECK(sockets[0].address == kGroup);
  CHECK(sockets[0].port == 7667);
  CHECK(sockets[0].user == 1000);
  CHECK(sockets[0].inode == 81723);
  CHECK_FALSE(sockets[0].is_any_address);
  CHECK(sockets[1].is_any_address);
  CHECK(sockets[1].port == 53);
}

TEST_CASE("an URL that names no group is refused") {
  CHECK(parse_udpm_url("udpm://").port == 7667);
  CHECK(parse_udpm_url("udpm://239.255.76.68:7000?ttl=0&recv_buf_size=1000").receive_buffer_bytes ==
        1000);
  CHECK(parse_udpm_url("udpm://239.255.76.68").address == kGroup);
  for (const char* url : {"udpm://127.0.0.1:7667", "udpm://239.255.76.68:70000", "udpm://host:1",
                          "udpm://239.255.76.68:", "udpm://239.255.76.68:7000?recv_buf_size=x"}) {
    INFO(url);
    CHECK_THROWS_AS(parse_udpm_url(url), BusError);
  }
}

/// Publishes 100 MB, or 30,000 messages, in messages of `size` at `bytes_per_s` and hands out in
/// between; gives how many came of how many.
template <class HandleAll>
std::pair<int, int> paced_traffic(LiveBus& sender, std::size_t size, double bytes_per_s,
                                  const int& heard, const HandleAll& handle_all) {
  using Clock = std::chrono::steady_clock;
  const Datagram bytes(size, 'x');
  const int count = static_cast<int>(std::min<std::size_t>(30000, 100000000 / size));
  const int before = heard;
  const auto start = Clock::now();
  for (int i = 0; i < count; ++i) {
    sender.publish("SPEED", bytes);
    const std::chrono::duration<double> due(static_cast<double>(i + 1) * static_cast<double>(size) /
                                            bytes_per_s);
    do {
      handle_all(0);
    } while (Clock::now() - start < due);
  }
  handle_all(300);
  return {heard - before, count};
}

// Figures for README: how much the receiver takes, beside liblcm's. Not a test.
TEST_CASE("messages per second", "[.measure]") {
  using Clock = std::chrono::steady_clock;
  keep_freed_memory();  // as every process does
  UdpmReassembler reassembler;
  const Datagram datagram = short_datagram(1, with_nul("X"), Datagram(1000, 'x'));
  const auto start = Clock::now();
  for (int i = 0; i < 1000000; ++i) reassembler.take(datagram, {1, 1}, i);
  const std::chrono::duration<double> took = Clock::now() - start;
  WARN(1.0 / took.count() << " million datagrams/s decoded");

  LiveBus sender(own_url());
  int heard = 0;
  for (const double bytes_per_s : {60e6, 200e6, 1e12}) {
    for (const std::size_t size : {1000UL, 60000UL, 1000000UL}) {
      auto bus = std::make_unique<LiveBus>(own_url());
      bus->subscribe("SPEED", 0, [&](const BusMessage&) { ++heard; });
      const auto [ours, count] = paced_traffic(sender, size, bytes_per_s, heard, [&](int wait_ms) {
        while (bus->handle_one(wait_ms)) {
        }
      });
      bus.reset();

      lcm_t* lcm = lcm_create(own_url().c_str());
      auto* subscription = lcm_subscribe(
          lcm, "SPEED",
          [](const lcm_recv_buf_t*, const char*, void* to) { ++*static_cast<int*>(to); }, &heard);
      lcm_subscription_set_queue_capacity(subscription, 100000);
      const auto theirs = paced_traffic(sender, size, bytes_per_s, heard, [&](int wait_ms) {
        while (lcm_handle_timeout(lcm, wait_ms) > 0) {
        }
      });
      lcm_destroy(lcm);
      WARN(bytes_per_s / 1e6 << " MB/s in " << size << " bytes: " << ours << " of " << count
                             << ", liblcm " << theirs.first);
    }
  }
}
