// A service and its list of channels: what the adapter binds, what --help says.
#include "common/bus/channel_list.hpp"

#include "common/bus/memory_bus.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

struct Declared {
  ChannelList all{"a socket", "a page"};
  std::string steps = all.in("STEPS", "steps");
  std::string sweeps = all.in_if("SWEEPS", "where wanted");
  std::string sum = all.out("SUM", "their sum");
};

/// What hosting the toy says, where it declares these channels; empty = it is hosted.
std::string problem_of(const ChannelList& channels) {
  Service service = toy_service();
  service.channels = channels;
  MemoryBus bus;
  try {
    const HostedService hosted(service, bus, no_clock(), "", "test.toml");
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a list of channels as one line and as a paragraph of --help") {
  const Declared channels;
  CHECK(channels.all.summary() == "a socket, STEPS, SWEEPS -> SUM, a page");
  CHECK(channels.all.help() ==
        "Channels:\n"
        "  in   a socket\n"
        "  in   STEPS   steps\n"
        "  in   SWEEPS  where wanted\n"
        "  out  SUM     their sum\n"
        "  out  a page\n"
        "  out  HEALTH, LOG, CONFIG, as every process\n");
}

TEST_CASE("a channel that is renamed is renamed in the list, too") {
  Declared channels;
  channels.all.rename(channels.sum, "TOTAL");
  CHECK(channels.sum == "TOTAL");
  CHECK(channels.all.summary() == "a socket, STEPS, SWEEPS -> TOTAL, a page");
}

TEST_CASE("a service does not start where its adapter binds other channels than it declares") {
  CHECK(problem_of(toy_service().channels).empty());

  ChannelList lacking;
  lacking.out("RAW_POSE", "");
  CHECK(problem_of(lacking) == "toy: ODOMETRY (in) is bound and not declared");

  ChannelList turned;
  turned.in("RAW_POSE", "");
  turned.in("ODOMETRY", "");
  CHECK(problem_of(turned) ==
        "toy: RAW_POSE (in) is declared and not bound, RAW_POSE (out) is bound and not declared");

  ChannelList beyond = toy_service().channels;
  beyond.in("GNSS", "");
  CHECK(problem_of(beyond) == "toy: GNSS (in) is declared and not bound");

  ChannelList optional = toy_service().channels;
  optional.in_if("GNSS", "where wanted");
  CHECK(problem_of(optional).empty());
}

TEST_CASE("a suffix does not change the channels as the service declares them") {
  MemoryBus bus;
  const std::string toml = "[runtime]\nchannel_suffix = \"_ALT\"\nsuffixed_inputs = \"ODOMETRY\"\n";
  HostedService hosted(toy_service(), bus, no_clock(), toml, "test.toml");
  CHECK(hosted.node().takes("ODOMETRY_ALT"));
  CHECK(toy_service().channels.difference(hosted.node().channels()).empty());
}
