// The parts of a node by themselves: ticks, LOG, when a snapshot is due, the state's bytes.
#include <stdexcept>
#include <vector>

#include "common/bus/announcer.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/bus/message_timers.hpp"
#include "common/bus/node_state.hpp"
#include "common/bus/reason_counts.hpp"
#include "common/bus/state_keeper.hpp"
#include "common/wire/guard.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"
#include "understory/log_t.hpp"

using namespace understory;
using namespace understory::bus;

TEST_CASE("a timer ticks once per period of message time, also over gaps") {
  std::vector<std::int64_t> ticks;
  MessageTimers timers;
  timers.add(10, [&](std::int64_t due_us) { ticks.push_back(due_us); });
  CHECK_THROWS_AS(timers.add(0, [](std::int64_t) {}), std::logic_error);

  timers.fire(100);
  CHECK(ticks.empty());
  timers.fire(109);
  CHECK(ticks.empty());
  timers.fire(135);
  CHECK(ticks == std::vector<std::int64_t>{110, 120, 130});
  CHECK(timers.due_us() == std::vector<std::int64_t>{140});
}

TEST_CASE("after a jump of time a timer begins anew, after a restart it goes on") {
  std::vector<std::int64_t> ticks;
  MessageTimers timers;
  timers.add(10, [&](std::int64_t due_us) { ticks.push_back(due_us); });
  timers.fire(100);
  timers.start_over();
  timers.fire(1000);
  CHECK(ticks.empty());
  CHECK(timers.due_us() == std::vector<std::int64_t>{1010});

  timers.resume({505});
  timers.fire(506);
  CHECK(ticks == std::vector<std::int64_t>{505});
}

TEST_CASE("a flood of one fault is a few lines of LOG, of another channel one more") {
  std::vector<log_t> lines;
  MemoryBus bus(MemoryBus::Queues::kUnlimited, [&](const BusMessage& message) {
    lines.push_back(*wire::decode_bytes<log_t>(message.bytes));
  });
  Announcer announcer(bus, "toy", "1.0");
  for (int i = 0; i < 9; ++i) announcer.report(5, wire::Reason::kLate, "seq 3", "A");
  announcer.report(5, wire::Reason::kLate, "seq 3", "B");

  REQUIRE(lines.size() == 5);
  CHECK(lines[0].text == "seq 3");
  CHECK(lines[3].text == "seq 3 (8 so far)");
  CHECK(lines[4].channel == "B");
  CHECK(lines[4].seq == 4);

  announcer.mute(true);
  announcer.log(5, LogLevel::kInfo, "code", "text", "");
  CHECK(lines.size() == 5);
  announcer.mute(false);
  announcer.log(-1, LogLevel::kInfo, "code", "text", "");
  CHECK(lines.back().utime == 0);
  CHECK(lines.back().seq == 5);
}

TEST_CASE("reasons degrade the state for three seconds, duplicates never") {
  std::int64_t now = 1'000'000;
  ReasonCounts reasons({[] { return std::int64_t{7}; }, [&] { return now; }});
  reasons.add("A", wire::Reason::kDuplicate, "seq 1");
  CHECK(reasons.fresh() == Severity::kNote);
  reasons.add("A", wire::Reason::kNotFinite, "x");
  CHECK(reasons.fresh() == Severity::kDegraded);
  reasons.add("", wire::Reason::kStageFailed, "it threw");
  CHECK(reasons.fresh() == Severity::kError);
  now += ReasonCounts::kFreshUs;
  CHECK(reasons.fresh() == Severity::kNote);

  health_t message{};
  reasons.fill(message);
  CHECK(message.num_reasons == 3);
  CHECK(message.last_error_code == "stage_failed");
  CHECK(reasons.count_of("A", wire::Reason::kDuplicate) == 1);
}

TEST_CASE("a snapshot is due after so many inputs or so much time, and not before") {
  const test::Scratch scratch("keeper");
  StateStore store(scratch.path(), "toy");
  store.open();
  StateKeeper keeper(1000, 3);
  const auto make_state = [] { return std::string("state"); };
  CHECK_FALSE(keeper.is_due(100));
  CHECK_FALSE(keeper.append("IN", {}));  // without a store nothing is kept
  CHECK(keeper.journal_bytes() == 0);

  keeper.journal_to(&store);
  CHECK_FALSE(keeper.is_due(100));
  REQUIRE_FALSE(keeper.append("IN", {}));
  CHECK_FALSE(keeper.is_due(100));
  CHECK(keeper.is_due(1100));
  REQUIRE_FALSE(keeper.append("IN", {}));
  REQUIRE_FALSE(keeper.append("IN", {}));
  CHECK(keeper.is_due(200));
  CHECK(keeper.journal_bytes() > 0);

  REQUIRE_FALSE(keeper.save(200, make_state));
  CHECK(keeper.saved_utime() == 200);
  CHECK_FALSE(keeper.is_due(5000));  // no input since
}

TEST_CASE("a state that cannot be made is refused, and tried again a second later") {
  const test::Scratch scratch("keeper");
  StateStore store(scratch.path(), "toy");
  store.open();
  StateKeeper keeper(1000, 1);
  keeper.journal_to(&store);
  REQUIRE_FALSE(keeper.append("IN", {}));
  REQUIRE(keeper.is_due(100));

  const auto refusal =
      keeper.save(100, []() -> std::string { throw std::runtime_error("too large"); });
  REQUIRE(refusal);
  CHECK(refusal->reason == wire::Reason::kStateNotKept);
  CHECK(refusal->detail == "too large");
  CHECK_FALSE(keeper.is_due(999'000));
  CHECK(keeper.is_due(1'000'100));
}

TEST_CASE("the node's state survives its bytes, and another version is refused") {
  NodeState state;
  state.now_us = 42;
  state.inputs["A"] = {7, 41};
  state.paces["A"] = {41, 100};
  state.outputs["B"] = 9;
  state.timers_due_us = {-1, 50};
  state.stage = std::string("with a zero \0 inside", 20);

  const std::string bytes = state::save(NodeState::kFormat, state);
  NodeState loaded;
  state::load(bytes, NodeState::kFormat, loaded);
  CHECK(loaded.now_us == 42);
  CHECK(loaded.inputs == state.inputs);
  CHECK(loaded.paces == state.paces);
  CHECK(loaded.outputs == state.outputs);
  CHECK(loaded.timers_due_us == state.timers_due_us);
  CHECK(loaded.stage == state.stage);

  CHECK_THROWS_AS(state::load(bytes, state::Format{"node", 4}, loaded), std::invalid_argument);
  CHECK_THROWS_AS(state::load(bytes.substr(0, bytes.size() - 1), NodeState::kFormat, loaded),
                  std::invalid_argument);
}
