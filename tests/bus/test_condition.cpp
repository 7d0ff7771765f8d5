// Conditions: what is wrong as long as it is wrong.
#include "common/bus/condition.hpp"
#include "common/bus/memory_bus.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;

namespace {

void add(Condition& condition, int bad, int good) {
  for (int i = 0; i < bad; ++i) condition.add(true);
  for (int i = 0; i < good; ++i) condition.add(false);
}

health_t health_of(HostedService& hosted) { return hosted.node().health(); }

}  // namespace

TEST_CASE("a condition begins with enough bad events and ends with few", "[condition]") {
  Condition condition({20, 8});
  add(condition, 7, 20);
  CHECK_FALSE(condition.holds());
  add(condition, 8, 0);
  CHECK(condition.holds());
  add(condition, 0, 17);  // Three of the last twenty: more than a quarter of eight.
  CHECK(condition.bad() == 3);
  CHECK(condition.holds());
  add(condition, 0, 1);
  CHECK_FALSE(condition.holds());

  Condition widest({64, 64});
  add(widest, 63, 0);
  CHECK_FALSE(widest.holds());
  add(widest, 1, 0);
  CHECK(widest.holds());
}

TEST_CASE("a condition goes on where the saved one was", "[condition]") {
  const state::Format format{"condition", 1};
  Condition condition({20, 8});
  add(condition, 8, 10);
  Condition loaded({20, 8});
  state::load(state::save(format, condition), format, loaded);
  CHECK(loaded.holds());
  for (int i = 0; i < 30; ++i) {
    condition.add(i % 7 == 0);
    loaded.add(i % 7 == 0);
    REQUIRE(loaded.holds() == condition.holds());
  }
}

TEST_CASE("HEALTH shows a condition as long as it holds, the worst one first", "[condition]") {
  std::int64_t now_us = 0;
  HealthMonitor monitor("toy", "1", {[] { return std::int64_t{0}; }, [&] { return now_us; }});
  monitor.ready();
  CHECK(monitor.set_condition("", wire::Reason::kWithheld, true, "none is good"));
  CHECK(monitor.set_condition("", wire::Reason::kLost, true, "where am I"));
  CHECK_FALSE(monitor.set_condition("", wire::Reason::kLost, true, "where am I"));
  now_us = 3'600'000'000;  // Nothing is fresh any more.
  CHECK(monitor.state() == health_t::STATE_ERROR);
  CHECK(monitor.report(0).last_error_code == "lost");
  CHECK(monitor.report(0).last_error == "where am I");
  CHECK(monitor.count_of("", wire::Reason::kLost) == 1);

  CHECK(monitor.set_condition("", wire::Reason::kLost, false, ""));
  CHECK(monitor.state() == health_t::STATE_DEGRADED);
  CHECK(monitor.report(0).last_error_code == "withheld");
  monitor.set_condition("", wire::Reason::kWithheld, false, "");
  CHECK(monitor.state() == health_t::STATE_OK);
}

TEST_CASE("an input of which much is refused is named, until it is well again", "[condition]") {
  std::int64_t now_us = 0;
  MemoryBus bus(MemoryBus::Queues::kUnlimited);
  HostedService hosted(test::toy_service(), bus,
                       {[] { return std::int64_t{0}; }, [&] { return now_us; }}, "", "test.toml");
  hosted.node().connect();
  const auto send = [&](const wire::Bytes& bytes) {
    bus.publish("ODOMETRY", bytes);
    bus.drain();
    now_us += 10'000'000;  // Nothing is fresh.
  };

  for (int i = 0; i < 10; ++i) send(wire::encode_message(test::toy_input(i)));
  CHECK(health_of(hosted).state == health_t::STATE_OK);
  for (int i = 0; i < 738; ++i) send({1, 2, 3});
  CHECK(health_of(hosted).state == health_t::STATE_DEGRADED);
  CHECK(health_of(hosted).last_error_code == "input_refused");
  CHECK(hosted.node().monitor().count_of("ODOMETRY", wire::Reason::kInputRefused) == 1);

  for (int i = 10; i < 50; ++i) send(wire::encode_message(test::toy_input(i)));
  CHECK(health_of(hosted).state == health_t::STATE_OK);

  // What comes late is refused, too.
  send(wire::encode_message(test::toy_input(100)));
  for (int i = 60; i < 100; ++i) send(wire::encode_message(test::toy_input(i)));
  CHECK(health_of(hosted).last_error_code == "input_refused");
}
