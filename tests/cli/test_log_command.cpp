#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/model/program_version.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/config_t.hpp"
#include "understory/health_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Fixture {
  test::TemporaryDirectory directory;
  std::mt19937_64 random{3};
  std::vector<io::LogEvent> events = test::random_events(30, random);
  std::string whole = (directory / "whole.lcm").string();
  std::string damaged = (directory / "damaged.lcm").string();
  std::string out = (directory / "out.lcm").string();

  Fixture() {
    write_log(whole, events);
    auto bytes = test::read_bytes(whole);
    bytes[test::offsets(events)[10]] ^= 0xFFU;
    write_bytes(damaged, bytes);
  }
  test::Outcome run(const std::string& arguments) {
    return understory_command(directory, arguments);
  }
};

}  // namespace

TEST_CASE_METHOD(Fixture, "wrong usage ends with 2 and shows the right one", "[cli]") {
  for (const char* arguments : {"", "log", "log info", "nonsense", "log info a b", "log cut ",
                                "log repair x", "launch --nonsense"}) {
    const auto outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    CHECK(outcome.status == 2);
    CHECK_FALSE(outcome.error.empty());
  }
  CHECK(run("log cut " + whole + " --out " + out + " --channels '('").status == 2);
  CHECK(run("log cut " + whole + " --out " + out + " --from 2 --to 1").status == 2);
  CHECK(run("--help").status == 0);
  CHECK(run("--version").status == 0);
}

TEST_CASE_METHOD(Fixture, "a file that cannot be read ends with 1 and one line that names it",
                 "[cli]") {
  for (const char* command :
       {"log info", "log check", "log repair --out o.lcm", "log cut --out o.lcm"}) {
    const auto outcome = run(std::string(command) + " " + (directory / "none.lcm").string());
    CAPTURE(command, outcome.error);
    CHECK(outcome.status == 1);
    CHECK(test::lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Contains("none.lcm"));
  }
}

TEST_CASE_METHOD(Fixture, "log info lists what is in a log", "[cli]") {
  const auto text = run("log info " + whole);
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("30 events in 2.9 s") && Contains("LANDMARKS"));
  const auto json = run("log info --json " + damaged);
  CHECK(json.status == 0);
  CHECK_THAT(json.out, Contains("\"events\": 29") && Contains("\"damaged_places\": 1"));
}

TEST_CASE_METHOD(Fixture, "log info says which versions made a log", "[cli]") {
  const std::string made = (directory / "made.lcm").string();
  {
    io::LcmLogWriter writer(made);
    config_t config{};
    config.process = "ekf";
    config.version = "1.2.0";
    writer.write(1, "CONFIG", wire::encode_bytes(config));
    config.process = "keyframer";
    writer.write(2, "CONFIG", wire::encode_bytes(config));
    health_t health{};
    health.process = "lat\x1b[2J";
    health.version = "1.1.0";
    writer.write(3, "HEALTH", wire::encode_bytes(health));
    writer.commit();
  }
  const auto text = run("log info " + made);
  CHECK_THAT(text.out, Contains("version 1.1.0: lat\\x1b[2J\n") &&
                           Contains("version 1.2.0: ekf, keyframer\n"));
  const auto json = nlohmann::json::parse(run("log info --json " + made).out);
  CHECK(json["version"] == model::program_version());
  CHECK(json["programs"].size() == 3);
  CHECK(json["programs"][0]["process"] == "ekf");
  CHECK(json["programs"][0]["version"] == "1.2.0");

  // A log of a simulation says so itself.
  const std::string simulated = (directory / "sim.lcm").string();
  REQUIRE(run("sim intermediate --length 2 --out " + simulated).status == 0);
  CHECK_THAT(run("log info " + simulated).out,
             Contains("version " + model::program_version() + ": understory sim\n"));
}

TEST_CASE_METHOD(Fixture, "log check finds damage and nothing where there is none", "[cli]") {
  // Random payloads are of no known type: nothing can be wrong with them.
  CHECK(run("log check " + whole).status == 0);
  const auto outcome = run("log check " + damaged);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.out, Contains("byte " + std::to_string(test::offsets(events)[10])));
  CHECK_THAT(outcome.error, Contains("damaged.lcm"));
}

TEST_CASE_METHOD(Fixture, "replay tells of damage where there is some", "[cli]") {
  const auto fine = run("replay " + whole + " --out " + out);
  CHECK(fine.status == 0);
  CHECK_THAT(fine.out, Contains("30 events read") && !Contains("damaged"));
  const auto broken = run("replay " + damaged + " --out " + out);
  CHECK(broken.status == 0);
  CHECK_THAT(broken.out, Contains("29 events read") && Contains("in 1 places"));
}

TEST_CASE_METHOD(Fixture, "log repair gives a log with nothing wrong", "[cli]") {
  CHECK(run("log repair " + damaged + " --out " + out).status == 0);
  CHECK(run("log check " + out).status == 0);
  io::LcmLogReader reader(out);
  CHECK(read_log(reader).size() == events.size() - 1);
}

TEST_CASE_METHOD(Fixture, "log repair saves nothing from a file that is no log", "[cli]") {
  write_bytes(damaged, test::Bytes(1000, 'x'));
  CHECK(run("log repair " + damaged + " --out " + out).status == 1);
  CHECK_FALSE(std::filesystem::exists(out));
}

TEST_CASE_METHOD(Fixture, "a file that is no log ends with 1, a log that was cut does not",
                 "[cli]") {
  const auto other = directory / "other.lcm";
  write_bytes(other, test::Bytes(1000, 'x'));
  for (const std::string command : {"log info", "log info --json", "log check", "log accuracy",
                                    "replay --out o.lcm", "export --out o"}) {
    const auto outcome = run(command + " " + other.string());
    CAPTURE(command, outcome.error);
    CHECK(outcome.status == 1);
    CHECK(test::lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Contains("other.lcm: no LCM log: no event in 1000 bytes"));
  }
  CHECK_FALSE(std::filesystem::exists("o.lcm"));

  // Cut within its last, its first event, and within the first magic number; empty.
  const auto bytes = test::read_bytes(whole);
  for (const std::size_t size :
       {bytes.size() - 1, std::size_t{40}, std::size_t{2}, std::size_t{0}}) {
    write_bytes(other, test::Bytes(bytes.begin(), bytes.begin() + static_cast<long>(size)));
    CAPTURE(size);
    CHECK(run("log info " + other.string()).status == 0);
    CHECK(run("replay " + other.string() + " --out " + out).status == 0);
  }
}

TEST_CASE_METHOD(Fixture, "log cut takes time and channels", "[cli]") {
  CHECK(
      run("log cut " + whole + " --from 0.95 --to 2.05 --channels 'LAND.*' --out " + out).status ==
      0);
  io::LcmLogReader reader(out);
  const auto kept = read_log(reader);

  const auto expected = std::count_if(events.begin(), events.end(), [&](const io::LogEvent& e) {
    const auto time = e.utime - events[0].utime;
    return e.channel == "LANDMARKS" && time >= 950'000 && time <= 2'050'000;
  });

  CHECK(kept.size() == static_cast<std::size_t>(expected));
  CHECK(
      run("log cut " + whole + " --channels NONE --out " + (directory / "n.lcm").string()).status ==
      1);
  CHECK_FALSE(std::filesystem::exists(directory / "n.lcm"));
}

TEST_CASE_METHOD(Fixture, "a full disk ends with 1", "[cli]") {
  events[0].data.assign(1'000'000, 1);
  write_log(whole, events);
  const auto outcome = run("log repair " + whole + " --out /dev/full");
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error, Contains("/dev/full"));
}
