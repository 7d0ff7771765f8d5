// Fragments that come twice, and fragments of channels to which nobody listens.
#include <random>

#include "common/bus/live_bus.hpp"
#include "common/bus/reason_counts.hpp"
#include "common/bus/udpm_reassembly.hpp"
#include "tests/bus/datagrams.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

constexpr DatagramSender kSender{0x7F000001, 9};
constexpr std::int64_t kStale_us = ReassemblyLimits{}.stale_us;

/// Takes all of them at one instant; gives how many messages came out.
int messages_of(UdpmReassembler& reassembler, const std::vector<Datagram>& datagrams,
                std::int64_t now_us = 0) {
  int messages = 0;
  for (const Datagram& datagram : datagrams) {
    if (reassembler.take(datagram, kSender, now_us).message) ++messages;
  }
  return messages;
}

/// Each datagram twice in a row, as over two routes.
std::vector<Datagram> doubled(const std::vector<Datagram>& datagrams) {
  std::vector<Datagram> twice;
  for (const Datagram& datagram : datagrams) twice.insert(twice.end(), 2, datagram);
  return twice;
}

UdpmReassembler listener_to(const std::string& channel) {
  return UdpmReassembler({}, [channel](std::string_view name) { return name == channel; });
}

}  // namespace

TEST_CASE("a message over two routes comes out once, and nothing of it waits or is incomplete") {
  UdpmReassembler reassembler;
  const auto fragments = fragments_of(3, "TWICE", Datagram(5000, 'x'), 1400);
  CHECK(messages_of(reassembler, doubled(fragments)) == 1);
  CHECK(messages_of(reassembler, fragments, 1000) == 0);  // The slower route.
  CHECK(reassembler.held_messages() == 0);
  CHECK(reassembler.held_bytes() == 0);

  // What comes much later is another message by the same number.
  CHECK(messages_of(reassembler, fragments, 2 * kStale_us) == 1);
  CHECK(messages_of(reassembler, {short_datagram(4, with_nul("Y"), {})}, 5 * kStale_us) == 1);
  CHECK(reassembler.faults().count_of(DatagramFault::kRepeated) == 2 * fragments.size());
  CHECK(reassembler.faults().total() == 2 * fragments.size());
}

TEST_CASE("repetitions are counted in HEALTH and leave it OK; other faults degrade it") {
  ReasonCounts counts(system_clock());
  DatagramFaults faults;
  faults.set(DatagramFault::kRepeated, 7);
  counts.set_refused(faults);
  CHECK(counts.fresh() == Severity::kNote);
  health_t health{};
  counts.fill(health);
  REQUIRE(health.reasons.size() == 1);
  CHECK(health.reasons[0].reason == "datagram_repeated");
  CHECK(health.reasons[0].count == 7);
  CHECK(health.last_error_code.empty());

  faults.set(DatagramFault::kContradictory, 1);
  counts.set_refused(faults);
  CHECK(counts.fresh() == Severity::kDegraded);
}

TEST_CASE("a message that nobody wants is thrown away at the fragment that names its channel") {
  UdpmReassembler reassembler = listener_to("WANTED");
  const auto unwanted = fragments_of(1, "OTHER", Datagram(100000, 'x'), 1400);
  for (const Datagram& fragment : unwanted) {
    CHECK(messages_of(reassembler, {fragment}) == 0);
    CHECK(reassembler.held_bytes() == 0);
  }
  CHECK(messages_of(reassembler, fragments_of(2, "WANTED", Datagram(100000, 'x'), 1400)) == 1);

  // Nothing of it is missed when time goes by.
  messages_of(reassembler, {short_datagram(3, with_nul("WANTED"), {})}, 5 * kStale_us);
  CHECK(reassembler.faults().total() == 0);
}

TEST_CASE("fragments that overtake the one with the channel wait for it, and go with it") {
  std::mt19937_64 random(8);
  for (std::uint32_t run = 0; run < 50; ++run) {
    UdpmReassembler reassembler = listener_to("WANTED");
    auto unwanted = fragments_of(run, "OTHER", Datagram(20000, 'x'), 1400);
    std::shuffle(unwanted.begin(), unwanted.end(), random);
    CHECK(messages_of(reassembler, unwanted) == 0);
    CHECK(reassembler.held_bytes() == 0);

    auto wanted = fragments_of(run + 1, "WANTED", Datagram(20000, 'x'), 1400);
    std::shuffle(wanted.begin(), wanted.end(), random);
    CHECK(messages_of(reassembler, wanted) == 1);
    CHECK(reassembler.faults().total() == 0);
  }
}

TEST_CASE("what is known of settled messages is bounded") {
  ReassemblyLimits limits;
  limits.settled_of_sender = 4;
  UdpmReassembler reassembler(limits);
  const Datagram payload(3000, 'x');
  for (std::uint32_t i = 0; i < 5; ++i) {
    CHECK(messages_of(reassembler, fragments_of(i, "X", payload, 1400)) == 1);
  }
  CHECK(messages_of(reassembler, fragments_of(4, "X", payload, 1400)) == 0);
  CHECK(messages_of(reassembler, fragments_of(0, "X", payload, 1400)) == 1);  // Forgotten.
}
