// Stamps that wait for proof, and what proves them.
#include "common/bus/time_gate.hpp"
#include "tests/catch.hpp"

using namespace understory;
using bus::ChannelPace;
using bus::TimeGate;
using Verdict = bus::MessageClock::Verdict;

namespace {

constexpr std::int64_t kSecond = 1'000'000;

/// A gate whose time is 100 s.
TimeGate gate_at_100_s() {
  TimeGate gate(10 * kSecond);
  CHECK(gate.take({"FAST", {}, 0}, 100 * kSecond, {}) == Verdict::kFine);
  return gate;
}

Verdict take(TimeGate& gate, const char* channel, double seconds, const ChannelPace& pace = {}) {
  return gate.take({channel, {}, 0}, static_cast<std::int64_t>(seconds * kSecond), pace);
}

}  // namespace

TEST_CASE("three stamps in a row that agree are believed") {
  TimeGate gate = gate_at_100_s();
  CHECK(take(gate, "FAST", 150.0) == Verdict::kQuarantined);
  CHECK(take(gate, "FAST", 150.1) == Verdict::kAgrees);
  CHECK(take(gate, "FAST", 150.2) == Verdict::kJumped);
  CHECK(gate.jumped().size() == 3);
  CHECK(gate.wrong().empty());
}

TEST_CASE("what waits is wrong where time goes on from before it") {
  TimeGate gate = gate_at_100_s();
  take(gate, "FAST", 150.0);
  take(gate, "FAST", 150.1);
  CHECK(take(gate, "FAST", 100.1) == Verdict::kFine);
  CHECK(gate.wrong().size() == 2);
}

TEST_CASE("a slow channel that goes on at its pace proves what has waited beside it") {
  // SLAM_UPDATE waits after half a minute without keyframes; MAP_DELTA has had such a pause before.
  const ChannelPace slow{100 * kSecond, 20 * kSecond};
  TimeGate gate = gate_at_100_s();
  CHECK(take(gate, "FAST", 130.0) == Verdict::kQuarantined);
  CHECK(take(gate, "FAST", 130.8) == Verdict::kAgrees);
  CHECK(take(gate, "SLOW", 130.8, slow) == Verdict::kJumped);
  CHECK(gate.wrong().empty());
  const auto proven = gate.jumped();
  REQUIRE(proven.size() == 3);
  CHECK(proven.front().utime == 130 * kSecond);

  // It does not prove a stamp of elsewhere.
  TimeGate other = gate_at_100_s();
  CHECK(take(other, "FAST", 1e9) == Verdict::kQuarantined);
  CHECK(take(other, "SLOW", 130.8, slow) == Verdict::kFine);
  CHECK(other.wrong().size() == 1);
}
