// One suite for every implementation of Bus.
#include <unistd.h>

#include <functional>
#include <memory>

#include "common/bus/bulk_group.hpp"
#include "common/bus/live_bus.hpp"
#include "common/bus/memory_bus.hpp"
#include "tests/bus/faulty_bus.hpp"
#include "tests/bus/late_bus.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A group of this test process's own; TTL 0: it never leaves the computer.
std::string private_url() {
  return "udpm://239.255.76.67:" + std::to_string(20000 + ::getpid() % 20000) + "?ttl=0";
}

std::unique_ptr<Bus> make_bus(const std::string& kind) {
  if (kind == "live") return std::make_unique<LiveBus>(private_url());
  if (kind == "split") return make_live_bus(private_url());
  return std::make_unique<MemoryBus>();
}

/// Handles until `count` messages came, or nothing more comes for a second.
void handle(Bus& bus, const std::function<bool()>& is_done) {
  for (int idle = 0; idle < 10 && !is_done();) {
    if (!bus.handle_one(100)) ++idle;
  }
}

}  // namespace

TEST_CASE("messages arrive whole, in order, on their channel only") {
  const auto kind = GENERATE(as<std::string>(), "memory", "live", "split");
  INFO(kind);
  const auto bus = make_bus(kind);
  std::vector<std::pair<std::string, Bytes>> got;

  const auto note = [&](const BusMessage& message) {
    got.emplace_back(message.channel, Bytes(message.bytes.begin(), message.bytes.end()));
  };

  bus->subscribe("A.B", 100, note);  // a dot is a dot, not any letter
  bus->subscribe("LARGE", 100, note);
  std::vector<std::pair<std::string, Bytes>> sent;
  for (int i = 0; i < 20; ++i) sent.emplace_back("A.B", Bytes(static_cast<std::size_t>(i), 7));
  sent.emplace_back("LARGE", Bytes(300000, 9));

  for (const auto& [channel, bytes] : sent) {
    CHECK_FALSE(bus->publish("AXB", bytes));
    CHECK_FALSE(bus->publish(channel, bytes));
  }

  handle(*bus, [&] { return got.size() == sent.size(); });
  CHECK(got == sent);
}

TEST_CASE("a full queue drops the oldest, and counts") {
  const auto kind = GENERATE(as<std::string>(), "memory", "live", "split");
  INFO(kind);
  const auto bus = make_bus(kind);
  std::vector<int> got;
  bus->subscribe("COUNT", 5, [&](const BusMessage& message) { got.push_back(message.bytes[0]); });
  for (std::uint8_t i = 0; i < 20; ++i) bus->publish("COUNT", Bytes{i});
  // The live bus takes in what the socket's thread has received; wait until all of it is there.
  if (kind != "memory") ::usleep(200000);
  handle(*bus, [&] { return got.size() == 5; });
  CHECK(got == std::vector<int>{15, 16, 17, 18, 19});
  CHECK(bus->dropped("COUNT") == 15);
}

TEST_CASE("handlers may publish, and what they throw comes out of handle_one") {
  const auto kind = GENERATE(as<std::string>(), "memory", "live", "split");
  INFO(kind);
  const auto bus = make_bus(kind);
  int answers = 0;
  bus->subscribe("ASK", 10,
                 [&](const BusMessage& message) { bus->publish("ANSWER", message.bytes); });
  bus->subscribe("ANSWER", 10, [&](const BusMessage&) { ++answers; });
  bus->subscribe("BAD", 10, [](const BusMessage&) { throw std::runtime_error("bad"); });

  bus->publish("ASK", Bytes{1});
  handle(*bus, [&] { return answers == 1; });
  CHECK(answers == 1);
  bus->publish("BAD", Bytes{1});
  CHECK_THROWS_WITH(handle(*bus, [] { return false; }), "bad");
  bus->publish("ASK", Bytes{1});
  handle(*bus, [&] { return answers == 2; });

  CHECK(answers == 2);
}

TEST_CASE("what cannot be sent is refused") {
  const auto kind = GENERATE(as<std::string>(), "memory", "live", "split");
  const auto bus = make_bus(kind);
  CHECK(bus->publish("", Bytes{1})->reason == wire::Reason::kNotSent);
  CHECK(bus->publish(std::string(64, 'A'), Bytes{1})->reason == wire::Reason::kNotSent);
  CHECK_FALSE(bus->publish(std::string(63, 'A'), Bytes{1}));
}

TEST_CASE("sweeps travel in a group of their own, paced, and only to who wants them") {
  CHECK(bulk_lcm_url("udpm://239.255.76.67:7667?ttl=0") == "udpm://239.255.76.68:7668?ttl=0");
  CHECK(bulk_lcm_url("memq://") == "memq://");
  CHECK(is_bulk_channel("LIDAR_SWEEP_ALT"));
  CHECK_FALSE(is_bulk_channel("LIDAR_SCAN"));
  const auto sender = make_live_bus(private_url());
  const auto receiver = make_live_bus(private_url());
  LiveBus bystander(private_url());

  int sweeps = 0;
  int others = 0;
  int overheard = 0;

  receiver->subscribe("LIDAR_SWEEP", 0, [&](const BusMessage& message) {
    if (message.bytes.size() == 50000) ++sweeps;
  });

  receiver->subscribe("OTHER", 0, [&](const BusMessage&) { ++others; });
  bystander.subscribe("LIDAR_SWEEP", 0, [&](const BusMessage&) { ++overheard; });
  for (int i = 0; i < 60; ++i) {
    CHECK_FALSE(sender->publish("LIDAR_SWEEP", Bytes(50000, 3)));
    if (i % 10 == 0) CHECK_FALSE(sender->publish("OTHER", Bytes(5, 3)));
  }

  handle(*receiver, [&] { return sweeps == 60 && others == 6; });
  CHECK(sweeps == 60);
  CHECK(others == 6);
  while (bystander.handle_one(0)) {
  }
  CHECK(overheard == 0);
}

TEST_CASE("the URL is completed so that nothing is lost or leaves by accident") {
  CHECK(complete_lcm_url("udpm://239.1.1.1:7000") ==
        "udpm://239.1.1.1:7000?recv_buf_size=4194304&ttl=0");
  CHECK(complete_lcm_url("udpm://239.1.1.1:7000?ttl=1") ==
        "udpm://239.1.1.1:7000?ttl=1&recv_buf_size=4194304");
  CHECK(complete_lcm_url("memq://") == "memq://");
  LiveBus bus(private_url());
  CHECK(bus.receive_buffer().wanted_bytes == kWantedReceiveBuffer);
  CHECK(bus.receive_buffer().granted_bytes > 0);
  CHECK_THROWS_AS(LiveBus("nonsense://x"), BusError);
}

TEST_CASE("a bus that the network can hear is refused by name") {
  CHECK_NOTHROW(require_closed_bus("udpm://239.1.1.1:7000"));
  CHECK_NOTHROW(require_closed_bus("udpm://239.1.1.1:7000?ttl=0"));
  CHECK_NOTHROW(require_closed_bus("memq://"));
  for (const char* url :
       {"udpm://239.1.1.1:7000?ttl=1", "udpm://239.1.1.1:7000?recv_buf_size=9&ttl=255"})
    CHECK_THROWS_WITH(require_closed_bus(url),
                      Catch::Matchers::Contains(url) && Catch::Matchers::Contains("--open-bus"));
  CHECK_THROWS_AS(require_closed_bus("udpm://239.1.1.1:7000?ttl=256"), BusError);
}

TEST_CASE("faults are counted, seeded, and together make up all messages") {
  const auto run = [](std::uint64_t seed) {
    MemoryBus inner(MemoryBus::Queues::kUnlimited);
    FaultyBus bus(inner,
                  {.drop = 0.1,
                   .duplicate = 0.1,
                   .delay = 0.1,
                   .reorder = 0.1,
                   .corrupt = 0.1,
                   .truncate = 0.1,
                   .flood = 0.05,
                   .channels = {"X"}},
                  seed);
    std::vector<Bytes> got;

    bus.subscribe("X", 0, [&](const BusMessage& message) {
      got.emplace_back(message.bytes.begin(), message.bytes.end());
    });

    std::size_t others = 0;
    bus.subscribe("Y", 0, [&](const BusMessage&) { ++others; });
    for (int i = 0; i < 2000; ++i) {
      bus.publish("X", Bytes(8, static_cast<std::uint8_t>(i)));
      bus.publish("Y", Bytes(8, 0));
    }

    bus.flush();
    inner.drain();
    const FaultCounts& c = bus.counts();
    CHECK(others == 2000);
    CHECK(got.size() == 2000 - c.dropped + c.duplicated + c.flood_packets);

    for (const std::uint64_t count :
         {c.dropped, c.duplicated, c.delayed, c.reordered, c.corrupted, c.truncated}) {
      CHECK(count > 120);
      CHECK(count < 280);
    }

    CHECK(c.flood_packets > 0);
    return got;
  };

  CHECK(run(1) == run(1));
  CHECK(run(1) != run(2));
}

TEST_CASE("what is late comes in one burst, whole and in its order, before what follows from it") {
  MemoryBus inner(MemoryBus::Queues::kUnlimited);
  LateBus bus(inner);
  std::string heard;
  const auto note = [&](const BusMessage& message) {
    heard += std::string(message.channel) + std::to_string(message.bytes[0]) + " ";
  };
  bus.subscribe("A", 1, [&](const BusMessage& message) {
    note(message);
    bus.publish("ANSWER", message.bytes);
  });
  bus.subscribe("B", 1, note);
  inner.subscribe("ANSWER", 1, note);
  const auto send = [&](const std::string& channel, std::uint8_t number) {
    inner.publish(channel, Bytes{number});
    inner.drain();
  };

  // A process that is stopped.
  send("A", 1);
  bus.stop();
  send("A", 2);
  send("B", 3);
  send("A", 4);
  CHECK(heard == "A1 ANSWER1 ");
  bus.go_on();
  inner.drain();
  send("B", 5);
  CHECK(heard == "A1 ANSWER1 A2 B3 A4 ANSWER2 ANSWER4 B5 ");

  // One of its channels that is held back.
  heard.clear();
  bus.hold("ANSWER");
  send("A", 6);
  send("A", 7);
  CHECK(heard == "A6 A7 ");
  bus.go_on();
  inner.drain();
  CHECK(heard == "A6 A7 ANSWER6 ANSWER7 ");
}
