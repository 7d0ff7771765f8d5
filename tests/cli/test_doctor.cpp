// `understory doctor`: what it makes of a computer and of the processes on it.
#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/bus/live_bus.hpp"
#include "deploy/cli/doctor_findings.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
using cli::Finding;
using cli::Verdict;

namespace {

constexpr const char* kVersion = "1.2.3";
constexpr const char* kRouteHead =
    "Iface Destination Gateway Flags RefCnt Use Metric Mask MTU Window IRTT\n";
constexpr const char* kLoopbackRoute = "lo 000000E0 00000000 0001 0 0 0 000000F0 0 0 0\n";
constexpr const char* kDefaultRoute = "eth0 00000000 010200C0 0003 0 0 0 00000000 0 0 0\n";

health_t healthy(const std::string& process, std::int64_t pid) {
  health_t health{};
  health.process = process;
  health.version = kVersion;
  health.pid = pid;
  health.state = health_t::STATE_OK;
  return health;
}

void add_channel(health_t& health, const std::string& name, double rate_hz, std::int64_t messages,
                 std::int64_t lost = 0) {
  channel_health_t channel{};
  channel.channel = name;
  channel.rate_hz = rate_hz;
  channel.messages = messages;
  channel.lost = lost;
  health.channels.push_back(channel);
  health.num_channels = static_cast<std::int32_t>(health.channels.size());
}

/// The worst verdict on a subject; its text has to have `text`.
Verdict verdict_on(const std::vector<Finding>& findings, const std::string& subject,
                   const std::string& text) {
  Verdict worst = Verdict::kGood;
  bool is_there = false;
  for (const Finding& one : findings) {
    if (one.subject != subject || one.text.find(text) == std::string::npos) continue;
    is_there = true;
    worst = std::max(worst, one.verdict);
    CHECK((one.verdict == Verdict::kGood || !one.advice.empty()));
  }
  CAPTURE(subject, text, cli::findings_text(findings));
  CHECK(is_there);
  return worst;
}

std::vector<Finding> on_processes(const std::vector<health_t>& heard,
                                  const std::vector<cli::LocalProcess>& running = {}) {
  return cli::process_findings(heard, running, kVersion);
}

Verdict on_route(const std::string& routes, const std::string& flags, const std::string& text) {
  return verdict_on(cli::route_findings({}, kRouteHead + routes, flags), "route", text);
}

}  // namespace

TEST_CASE("doctor knows URLs that no bus is on and those that leave the computer", "[cli]") {
  const auto on = [](const std::string& url, const std::string& text) {
    return verdict_on(cli::url_findings(url), "bus", text);
  };
  CHECK(on("udpm://239.255.76.67:7667?ttl=0", "239.255.76.67") == Verdict::kGood);
  CHECK(on("udpm://239.255.76.67:7667?ttl=1", "above 0") == Verdict::kAdvice);
  CHECK(on("udpm://239.255.76.67:7667?ttl=x", "no TTL") == Verdict::kBad);
  CHECK(on("udpm://10.0.0.1:7667", "no IPv4 multicast group") == Verdict::kBad);
  CHECK(on("udpm://239.255.76.67:seven", "no port") == Verdict::kBad);
  CHECK(on("file:///tmp/x.lcm", "no udpm://") == Verdict::kBad);
}

TEST_CASE("doctor reads the routes as the kernel does", "[cli]") {
  CHECK(on_route("", "0x1009", "none to the multicast group") == Verdict::kBad);
  CHECK(on_route(kLoopbackRoute, "0x1009", "over lo") == Verdict::kGood);
  CHECK(on_route(kLoopbackRoute, "0x9", "switched off") == Verdict::kBad);
  CHECK(on_route(kDefaultRoute, "0x9", "eth0, by the default route") == Verdict::kAdvice);
  CHECK(on_route(std::string(kDefaultRoute) + kLoopbackRoute, "0x1009", "over lo") ==
        Verdict::kGood);
  const std::string other = "eth1 000000E0 00000000 0001 0 0 0 000000F0 0 0 0\n";
  CHECK(on_route(kLoopbackRoute + other, "0x1009", "lo and eth1") == Verdict::kAdvice);
  const std::string worse = "eth1 000000E0 00000000 0001 0 0 5 000000F0 0 0 0\n";
  CHECK(on_route(worse + kLoopbackRoute, "0x1009", "over lo") == Verdict::kGood);
  CHECK(on_route("nonsense\neth0 zz\n", "", "none") == Verdict::kBad);
}

TEST_CASE("doctor finds what is wrong with processes that run", "[cli]") {
  CHECK(verdict_on(on_processes({}), "processes", "none runs") == Verdict::kGood);
  const auto fine = on_processes({healthy("ekf", 1), healthy("ekf", 1), healthy("keyframer", 2)},
                                 {{1, "understory-ekf"}});
  CHECK(
      std::ranges::all_of(fine, [](const Finding& one) { return one.verdict == Verdict::kGood; }));

  CHECK(verdict_on(on_processes({healthy("ekf", 1), healthy("ekf", 7)}), "processes",
                   "ekf runs more than once (processes 1, 7)") == Verdict::kBad);
  // HEALTH with pid 0 is the supervisor's, for a process that it gave up.
  CHECK(std::ranges::none_of(on_processes({healthy("ekf", 1), healthy("ekf", 0)}),
                             [](const Finding& one) { return one.verdict == Verdict::kBad; }));
  auto old = healthy("ekf", 1);
  old.version = "1.0.0";
  CHECK(verdict_on(on_processes({old}), "versions", "1.0.0: ekf") == Verdict::kBad);
  CHECK(verdict_on(on_processes({old, healthy("keyframer", 2)}), "versions", "1.2.3: keyframer") ==
        Verdict::kBad);
  CHECK(verdict_on(on_processes({healthy("ekf", 1)}, {{1, "understory-ekf"}, {9, "understory-x"}}),
                   "processes", "understory-x (process 9) runs, but") == Verdict::kBad);

  auto ill = healthy("ekf", 1);
  ill.state = health_t::STATE_ERROR;
  ill.last_error_code = "diverged";
  CHECK(verdict_on(on_processes({ill}), "processes", "ekf is in error: diverged") == Verdict::kBad);
  auto small = healthy("ekf", 1);
  small.receive_buffer_bytes = 1;
  small.receive_buffer_wanted_bytes = 2;
  CHECK(verdict_on(on_processes({small}), "receive buffer", "ekf") == Verdict::kAdvice);
}

TEST_CASE("doctor finds losses by their share, and sensors from which nothing comes", "[cli]") {
  auto losing = healthy("ekf", 1);
  add_channel(losing, "ODOMETRY", 10.0, 100'000, 50);
  CHECK(verdict_on(on_processes({losing}), "losses", "50 of ODOMETRY") == Verdict::kAdvice);
  add_channel(losing, "LANDMARKS", 10.0, 900, 100);
  CHECK(verdict_on(on_processes({losing}), "losses", "LANDMARKS messages (10.0 %)") ==
        Verdict::kBad);

  auto input = healthy("lidar_imu_input", 1);
  add_channel(input, "RAW_SWEEP", 0.0, 10);
  add_channel(input, "RAW_IMU", 100.0, 1000);
  CHECK(verdict_on(on_processes({input}), "sensors", "no laser: nothing on RAW_SWEEP") ==
        Verdict::kBad);
  input.channels[0].rate_hz = 10.0;
  input.channels[1].rate_hz = 0.0;
  CHECK(verdict_on(on_processes({input}), "sensors", "no motion") == Verdict::kAdvice);
  add_channel(input, "RAW_WHEELS", 50.0, 1000);
  CHECK(verdict_on(on_processes({input}), "sensors", "nothing on RAW_IMU") == Verdict::kGood);
}

TEST_CASE("doctor asks for sensors only the process that has them as inputs", "[cli]") {
  const auto bad = [](const std::vector<Finding>& findings) {
    return std::ranges::count(findings, "sensors", &Finding::subject);
  };
  // Dead reckoning is no sensor, whether it comes or not.
  for (const double rate_hz : {0.0, 50.0}) {
    auto filter = healthy("ekf", 1);
    add_channel(filter, "RAW_POSE", rate_hz, 100);
    CHECK(bad(on_processes({filter})) == 0);
  }
  auto recorder = healthy("gnss_recorder", 1);
  add_channel(recorder, "RAW_GNSS", 10.0, 100);
  CHECK(bad(on_processes({recorder})) == 0);
}

TEST_CASE("doctor looks at clock, governor and the place of the state", "[cli]") {
  CHECK(cli::clock_jump_finding(2'500'000, 2'500'900).verdict == Verdict::kGood);
  CHECK(cli::clock_jump_finding(2'500'000, 1'000'000).verdict == Verdict::kBad);
  CHECK(cli::governor_finding("powersave").verdict == Verdict::kAdvice);
  CHECK(cli::governor_finding("").verdict == Verdict::kGood);

  const test::TemporaryDirectory directory;
  CHECK(cli::state_finding((directory / "not/there/yet").string()).verdict != Verdict::kBad);
  write_bytes(directory / "file", {1});
  CHECK(cli::state_finding((directory / "file/state").string()).verdict == Verdict::kBad);
}

TEST_CASE("doctor runs a program to see that it starts and is of this version", "[cli]") {
  const test::TemporaryDirectory directory;
  const auto program = [&](const char* name, const std::string& text) {
    const auto path = directory / name;
    write_bytes(path, test::Bytes(text.begin(), text.end()));
    ::chmod(path.c_str(), 0755);
    return path.string();
  };
  const std::string good = program("it's good", "#!/bin/sh\necho 1.2.3\n");
  const std::string old = program("old", "#!/bin/sh\necho 1.0.0\n");
  const std::string broken = program("broken", "#!/bin/sh\nexit 127\n");
  const auto on = [](const std::string& path, const std::string& text) {
    return verdict_on(cli::program_findings({path}, kVersion), "programs", text);
  };
  CHECK(on(good, "1 of them") == Verdict::kGood);
  CHECK(on(old, "version 1.0.0, the command is 1.2.3") == Verdict::kBad);
  CHECK(on(broken, "does not start") == Verdict::kBad);
  CHECK(on((directory / "none").string(), "not built or not installed") == Verdict::kAdvice);
}

TEST_CASE("doctor as a command: JSON, and 1 where something must be mended", "[cli]") {
  const test::TemporaryDirectory directory;
  const auto bad = understory_command(directory, "doctor --json --lcm-url udpm://10.0.0.1:7667");
  CHECK(bad.status == 1);
  CHECK_THAT(bad.error, Contains("to be mended"));
  const auto json = nlohmann::json::parse(bad.out);
  CHECK(json.at("ok") == false);
  CHECK(json.at("findings").at(0).at("verdict") == "bad");
  CHECK(json.at("findings").at(0).at("subject") == "bus");
  CHECK_FALSE(json.at("findings").at(0).at("advice").get<std::string>().empty());
  const auto text = understory_command(directory, "doctor --lcm-url udpm://10.0.0.1:7667");
  CHECK_THAT(text.out, Contains("BAD    bus") && Contains("receive buffer") && Contains("->"));
}
