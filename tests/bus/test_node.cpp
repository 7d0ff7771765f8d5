// From bytes to a stage and back, with faults.
#include <limits>

#include "common/bus/memory_bus.hpp"
#include "tests/bus/faulty_bus.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

/// A toy on a bus, with everything that it publishes.
struct Bench {
  explicit Bench(const std::string& toml = "")
      : bus(MemoryBus::Queues::kUnlimited),
        hosted(toy_service(), bus, no_clock(), toml, "test.toml") {
    bus.subscribe("RAW_POSE", 0, [this](const BusMessage& message) {
      const auto pose = wire::decode_message<raw_pose_t>(message.bytes);
      REQUIRE(pose);
      poses.push_back(*pose);
    });
    hosted.node().connect();
  }
  void send(const model::Odometry& motion) {
    bus.publish("ODOMETRY", wire::encode_message(motion));
    bus.drain();
  }
  std::int64_t count(wire::Reason reason) {
    return hosted.node().monitor().count_of("ODOMETRY", reason);
  }

  MemoryBus bus;
  HostedService hosted;
  std::vector<raw_pose_t> poses;
};

/// Hands out messages as if they had come at a known time.
class StampingBus : public MemoryBus {
 public:
  explicit StampingBus(std::int64_t received_us)
      : MemoryBus(MemoryBus::Queues::kUnlimited), received_us_(received_us) {}
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override {
    MemoryBus::subscribe(channel, queue_size, [this, handler](const BusMessage& message) {
      handler({message.channel, message.bytes, received_us_});
    });
  }

 private:
  std::int64_t received_us_;
};

}  // namespace

TEST_CASE("a message beyond what the configuration allows is refused unread, and counted") {
  MemoryBus bus;
  NodeOptions options;
  options.process = "bounded";
  Node node(bus, options, no_clock());
  int taken = 0;
  const std::size_t bytes = wire::bytes_with<landmarks_t, detection_t>(3);
  node.subscribe<landmarks_t>("LANDMARKS", [&](const landmarks_t&) { ++taken; },
                              {.most_bytes = bytes});
  node.connect();
  landmarks_t scan{};
  for (const std::size_t size : {3, 4, 1000}) {
    scan.detections.resize(size);
    scan.num_detections = static_cast<std::int32_t>(size);
    ++scan.seq;
    const wire::Bytes encoded = wire::encode_message(scan);
    CHECK((encoded.size() == bytes) == (size == 3));
    bus.publish("LANDMARKS", encoded);
    bus.drain();
  }
  CHECK(taken == 1);
  CHECK(node.monitor().count_of("LANDMARKS", wire::Reason::kTooLarge) == 2);
  const health_t health = node.health();
  CHECK(health.last_error_code == "too_large");
  CHECK(health.state == health_t::STATE_DEGRADED);
}

TEST_CASE("latency is the time from the arrival of a message to the end of its handler") {
  StampingBus bus(5'000'000);
  const Clock clock{[] { return std::int64_t{5'000'700}; }, [] { return std::int64_t{0}; }};
  HostedService hosted(toy_service(), bus, clock, "", "test.toml");
  hosted.node().connect();
  for (int i = 0; i < 3; ++i) {
    bus.publish("ODOMETRY", wire::encode_message(test::toy_input(i)));
    bus.drain();
  }
  CHECK(hosted.node().monitor().report(0).latency_max_us == 700);
}

TEST_CASE("an input that must come and does not is told, as long as it does not") {
  MemoryBus bus;
  std::int64_t now_us = 0;
  const Clock clock{[&] { return now_us; }, [&] { return now_us; }};
  NodeOptions options;
  options.process = "test";
  Node node(bus, options, clock);
  const auto ignore = [](const model::Odometry&) {};
  node.subscribe<model::Odometry>("EXPECTED", ignore, {.cadence = Cadence::kExpected});
  node.subscribe<model::Odometry>("STEADY", ignore, {.cadence = Cadence::kSteady});
  node.subscribe<model::Odometry>("ANY", ignore);
  node.connect();
  const auto is_ok = [&] { return node.health().state == health_t::STATE_OK; };
  const auto send = [&](const char* channel) {
    bus.publish(channel,
                wire::encode_message(test::toy_input(static_cast<int>(now_us / 1'000'000))));
    bus.drain();
  };

  CHECK(is_ok());
  now_us = 30'000'000;
  CHECK_FALSE(is_ok());
  CHECK(node.health().last_error == "nothing comes on EXPECTED");

  // A reason counts for 3 s more.
  for (; now_us < 40'000'000; now_us += 1'000'000) {
    send("EXPECTED");
    send("ANY");
    CHECK(is_ok() == (now_us >= 33'000'000));
  }
  send("STEADY");
  for (; now_us < 60'000'000; now_us += 1'000'000) {
    send("EXPECTED");
    CHECK(is_ok() == (now_us < 42'000'000));
  }
}

TEST_CASE("values pass through, outputs are numbered from 0, ticks follow message time") {
  Bench bench("[toy]\ngain = 2\nevery = 5\n");
  for (int i = 0; i < 25; ++i) bench.send(test::toy_input(i));
  REQUIRE(bench.poses.size() == 5);
  for (std::size_t k = 0; k < 5; ++k) CHECK(bench.poses[k].seq == static_cast<std::int64_t>(k));
  CHECK(bench.poses.back().odom_T_vehicle.x == 2.0 * 25.0 * 26.0 / 2.0);
  CHECK(bench.poses.back().odom_T_vehicle.y == 2.0);  // 2.4 s since the first stamp
}

TEST_CASE("bad messages are refused by rule, counted, and change nothing") {
  Bench bench;
  Bench clean;
  for (int i = 0; i < 10; ++i) {
    clean.send(test::toy_input(i));
    bench.send(test::toy_input(i));
    model::Odometry bad = test::toy_input(i);
    bad.from_T_to = geometry::SE2(1e300, 0.0, 0.0);
    bench.send(bad);
    bad.from_T_to = geometry::SE2(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0);
    bench.send(bad);

    bad = test::toy_input(i);
    bad.covariance(0, 0) = -1.0;
    bench.send(bad);
    bench.bus.publish("ODOMETRY", std::vector<std::uint8_t>{1, 2, 3});
    bench.send(test::toy_input(i));
  }

  CHECK(bench.count(wire::Reason::kOutOfRange) == 10);
  CHECK(bench.count(wire::Reason::kNotFinite) == 10);
  CHECK(bench.count(wire::Reason::kNotPositive) == 10);
  CHECK(bench.count(wire::Reason::kTooShort) == 10);
  CHECK(bench.count(wire::Reason::kDuplicate) == 10);
  REQUIRE(bench.poses.size() == clean.poses.size());
  CHECK(wire::encode_bytes(bench.poses.back()) == wire::encode_bytes(clean.poses.back()));
}

TEST_CASE("a stage that throws is reported and goes on") {
  Bench bench("[toy]\nmode = \"throwing\"\n");
  for (int i = 0; i < 30; ++i) bench.send(test::toy_input(i));
  CHECK(bench.count(wire::Reason::kStageFailed) == 3);
  CHECK(bench.poses.size() == 27);
}

TEST_CASE("nothing that is not finite is published") {
  MemoryBus bus;
  int seen = 0;
  bus.subscribe("OUT", 10, [&](const BusMessage&) { ++seen; });
  NodeOptions options;
  options.process = "test";
  Node node(bus, options, no_clock());
  const auto out = node.advertise<raw_pose_t>("OUT");

  raw_pose_t pose{};
  out.publish(pose);
  pose.odom_T_vehicle.x = std::numeric_limits<double>::infinity();
  out.publish(pose);
  bus.drain();
  CHECK(seen == 1);
  CHECK(node.monitor().count_of("OUT", wire::Reason::kNotSent) == 1);
}

TEST_CASE("under loss, repetition, disorder and damage every message is accounted for") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Bench bench;
    FaultyBus faulty(bench.bus,
                     {.drop = 0.05,
                      .duplicate = 0.05,
                      .delay = 0.05,
                      .delay_messages = 3,
                      .reorder = 0.05,
                      .truncate = 0.05,
                      .flood = 0.01,
                      .channels = {}},
                     seed);
    const int sent = 1000;

    for (int i = 0; i < sent; ++i) {
      // The ends pass unharmed: a loss behind the last message cannot be noticed.
      Bus& way = i == 0 || i == sent - 1 ? static_cast<Bus&>(bench.bus) : faulty;
      if (i == sent - 1) faulty.flush();
      way.publish("ODOMETRY", wire::encode_message(test::toy_input(i)));
      bench.bus.drain();
    }

    const FaultCounts& faults = faulty.counts();
    const SequenceCounts& counts = bench.hosted.node().sequence_counts("ODOMETRY");
    CHECK(counts.lost == faults.dropped + faults.truncated);
    CHECK(counts.duplicates == faults.duplicated);
    const auto health = bench.hosted.node().health();
    CHECK(health.channels.at(0).malformed ==
          static_cast<std::int64_t>(faults.truncated + faults.flood_packets));
    CHECK(bench.poses.size() == sent - counts.lost - counts.late);

    for (std::size_t k = 1; k < bench.poses.size(); ++k) {
      CHECK(bench.poses[k - 1].utime < bench.poses[k].utime);
    }
  }
}

TEST_CASE("a suffix renames outputs, and inputs where asked") {
  MemoryBus bus;
  HostedService hosted(toy_service(), bus, no_clock(),
                       "[runtime]\nchannel_suffix = \"_ALT\"\nsuffixed_inputs = \"ODOMETRY\"\n",
                       "test.toml");
  CHECK(hosted.node().outputs() == std::vector<std::string>{"RAW_POSE_ALT"});
  CHECK(hosted.node().takes("ODOMETRY_ALT"));
  CHECK_FALSE(hosted.node().takes("ODOMETRY"));
}

TEST_CASE("what comes after a pause of any length is taken, whole and in order") {
  for (const model::Utime pause_us : {11'000'000LL, 60'000'000LL, 7'200'000'000LL}) {
    Bench paused;
    Bench straight;
    for (int i = 0; i < 40; ++i) {
      model::Odometry motion = test::toy_input(i);
      straight.send(motion);
      const model::Utime passed_us = i / 10 * pause_us;  // After each tenth message.
      motion.from_utime += passed_us;
      motion.utime += passed_us;
      paused.send(motion);
    }
    CHECK(paused.count(wire::Reason::kClockJump) == 0);
    REQUIRE(paused.poses.size() == straight.poses.size());
    CHECK(paused.poses.back().odom_T_vehicle.x == straight.poses.back().odom_T_vehicle.x);
  }
}

TEST_CASE("a channel with a message a minute is taken whole, a wrong stamp in it is not") {
  Bench bench;
  for (int i = 0; i < 30; ++i) {
    model::Odometry motion = test::toy_input(i);
    const model::Utime wrong_us = i == 20 ? 1'000'000'000'000'000 : 0;
    motion.from_utime = 60'000'000LL * i + 1 + wrong_us;
    motion.utime = motion.from_utime + 100'000;
    bench.send(motion);
  }
  CHECK(bench.count(wire::Reason::kClockJump) == 1);
  CHECK(bench.poses.size() == 29);
}
