// `understory log record`, run as a user would: what it writes, how it ends, what it refuses.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <map>
#include <thread>

#include "common/bus/live_bus.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

int record_port() { return 21000 + ::getpid() % 20000; }

struct RecordFixture {
  test::TemporaryDirectory directory;
  std::string url = "udpm://239.255.76.69:" + std::to_string(record_port()) + "?ttl=0";
  std::string file = (directory / "drive.lcm").string();

  /// Records while messages are sent, and ends it with `signal` once they have been.
  Outcome record(const std::string& options, const std::string& signal,
                 std::chrono::milliseconds pause = std::chrono::milliseconds(300)) {
    std::thread sender([&] {
      const auto bus = bus::make_live_bus(url);
      // Sent until the recorder is there, then a known number.
      for (int i = 0; i < 300 && !std::filesystem::exists(file); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      for (std::uint8_t i = 0; i < 50; ++i) {
        bus->publish("POSE", std::array<std::uint8_t, 3>{1, 2, i});
        bus->publish("OTHER", std::vector<std::uint8_t>(100000, i));
        bus->publish("RAW_SWEEP", std::vector<std::uint8_t>(50000, i));
      }
      std::this_thread::sleep_for(pause);
      const std::string kill = "kill -" + signal + " $(cat " + (directory / "pid").string() + ")";
      CHECK(std::system(kill.c_str()) == 0);  // NOLINT(cert-env33-c)
    });
    // The shell's own process becomes the recorder: its id is known.
    const std::string line = "echo $$ > " + (directory / "pid").string() + "; exec " +
                             UNDERSTORY_COMMAND + " log record --lcm-url '" + url + "' " + options +
                             " " + file + " > " + (directory / "stdout").string() + " 2> " +
                             (directory / "stderr").string();
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    sender.join();
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(directory / "stdout"),
            read_text(directory / "stderr")};
  }

  std::map<std::string, int> contents() {
    std::map<std::string, int> events;
    io::LcmLogReader reader(file);
    while (auto event = reader.next()) {
      CHECK(event->number == events["all"]++);
      CHECK(event->data.back() == events[event->channel]++);
      CHECK(event->utime > 1500000000000000);
    }
    CHECK(reader.damage().places == 0);
    return events;
  }
};

}  // namespace

TEST_CASE_METHOD(RecordFixture, "log record writes all messages and ends cleanly", "[cli]") {
  const auto signal = GENERATE(as<std::string>(), "INT", "TERM");
  const auto outcome = record("", signal);
  CAPTURE(outcome.error);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("100 messages, 5000150 bytes"));
  CHECK(contents() == std::map<std::string, int>{{"all", 100}, {"OTHER", 50}, {"POSE", 50}});

  const auto again = understory_command(directory, "log record --lcm-url '" + url + "' " + file);
  CHECK(again.status == 1);
  CHECK_THAT(again.error, Contains("drive.lcm: exists; --force overwrites it"));
  CHECK(contents()["all"] == 100);
}

TEST_CASE_METHOD(RecordFixture, "log record takes chosen channels, and the sweeps", "[cli]") {
  const auto outcome = record("--sweeps --channels '.*S.*'", "INT");
  CHECK(outcome.status == 0);
  CHECK(contents() == std::map<std::string, int>{{"all", 100}, {"POSE", 50}, {"RAW_SWEEP", 50}});
}

TEST_CASE_METHOD(RecordFixture, "a killed recorder leaves what it had a second before", "[cli]") {
  CHECK(record("", "KILL", std::chrono::milliseconds(2500)).status == -1);
  CHECK(contents()["all"] == 100);
}

TEST_CASE_METHOD(RecordFixture, "log record names a full disk and a port of others", "[cli]") {
  CHECK(understory_command(directory, "log record --channels '(' " + file).status == 2);
  CHECK(understory_command(directory, "log record " + (directory / "no" / "x.lcm").string() +
                                          " --lcm-url '" + url + "'")
            .status == 1);

  const int thief = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in any{};
  any.sin_family = AF_INET;
  any.sin_port = htons(static_cast<std::uint16_t>(record_port()));
  REQUIRE(::bind(thief, reinterpret_cast<sockaddr*>(&any), sizeof(any)) == 0);
  for (const std::string& command : {"log record " + file, std::string("status --once"),
                                     "launch --state-dir " + (directory / "s").string()}) {
    const auto deaf = understory_command(directory, command + " --lcm-url '" + url + "'");
    CAPTURE(command, deaf.error);
    CHECK(deaf.status == 1);
    CHECK(lines(deaf.error) == 1);
    CHECK_THAT(deaf.error, Contains("is taken by `test_cli`"));
  }
  CHECK_FALSE(std::filesystem::exists(file));
  ::close(thief);

  std::atomic<bool> is_done = false;
  std::thread sender([&] {
    const auto bus = bus::make_live_bus(url);
    while (!is_done) {
      bus->publish("LARGE", std::vector<std::uint8_t>(100000, 1));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const auto full = understory_command(directory, "log record /dev/full --lcm-url '" + url + "'");
  is_done = true;
  sender.join();
  CAPTURE(full.error);
  CHECK(full.status == 1);
  CHECK_THAT(full.error, Contains("/dev/full: cannot write: No space left"));
}
