#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <iterator>
#include <random>

#include "common/bus/launch_config.hpp"
#include "common/bus/parameter_table.hpp"
#include "deploy/launch/registry.hpp"
#include "deploy/launch/supervisor.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using namespace understory::launch;
using Catch::Matchers::Contains;
using understory::test::TemporaryDirectory;

namespace {

launch::ProcessSpec shell(const std::string& name, const std::string& script) {
  return {name, {"/bin/sh", {"-c", script}, {}}};
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Runs a supervisor until a condition holds; generous in time, since other tests run beside it.
struct Bench {
  std::string said;
  launch::Supervisor supervisor;

  explicit Bench(std::vector<launch::ProcessSpec> specs,
                 const launch::SupervisorParameters& parameters = {})
      : supervisor(std::move(specs), parameters, [this](const auto& process, const auto& text) {
          said += process + ": " + text + "\n";
        }) {}
  ~Bench() {
    supervisor.stop(launch::Clock::now());
    run_until([&] { return supervisor.stopped(); });
  }

  template <class Condition>
  bool run_until(Condition condition) {
    const auto end = launch::Clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (launch::Clock::now() > end) return false;
      ::poll(nullptr, 0, 2);
      supervisor.step(launch::Clock::now());
    }
    return true;
  }
  launch::ProcessStatus status(std::size_t i = 0) { return supervisor.status().at(i); }
};

}  // namespace

TEST_CASE("a killed process is started again, the others go on", "[launch]") {
  Bench bench({shell("a", "exec sleep 1000"), shell("b", "exec sleep 1000")});
  bench.supervisor.start({}, launch::Clock::now());
  const pid_t a = bench.status(0).pid;
  const pid_t b = bench.status(1).pid;
  ::kill(a, SIGKILL);
  REQUIRE(bench.run_until([&] { return bench.status(0).restarts == 1; }));
  CHECK(bench.status(0).pid != a);
  CHECK(bench.status(1).pid == b);
  CHECK_THAT(bench.said, Contains("a: killed by signal 9") && Contains("a: started again"));
  // After the back-off of 10 ms.
  const std::string ending = " ms after its end was noticed; restart 1";
  REQUIRE_THAT(bench.said, Contains(ending));
  const std::size_t end = bench.said.find(ending);
  CHECK(std::stoi(bench.said.substr(bench.said.rfind(' ', end - 1), end)) >= 10);
}

TEST_CASE("hangs are looked for ten times a second, and what is due is in time", "[launch]") {
  Bench bench({shell("a", "exec sleep 1000")});
  const auto now = launch::Clock::now();
  bench.supervisor.start({}, now);
  CHECK(bench.supervisor.wake_up(now) == now + launch::milliseconds(100));
  bench.supervisor.stop(now);
  const auto late = now + launch::milliseconds(850);
  CHECK(bench.supervisor.wake_up(late) == now + launch::milliseconds(900));
}

TEST_CASE("a process that always dies is given up with the reason, and tried at a slow pace",
          "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.restart.slow_retry = launch::milliseconds(400);
  const TemporaryDirectory directory;
  const std::string mended = directory / "mended";
  Bench bench({shell("a", "test -e " + mended + " && exec sleep 1000; exit 3")}, parameters);
  bench.supervisor.start({}, launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.status().is_given_up; }));
  CHECK(bench.status().state == launch::ProcessState::kGivenUp);
  CHECK(bench.status().restarts == 4);
  CHECK_FALSE(bench.supervisor.stopped());
  CHECK_THAT(bench.said, Contains("given up: 5 deaths") && Contains("status 3"));

  const auto given_up = launch::Clock::now();
  REQUIRE(bench.run_until([&] { return bench.status().restarts == 6; }));
  CHECK(launch::Clock::now() - given_up >= launch::milliseconds(790));
  CHECK(bench.said.find("given up: ") == bench.said.rfind("given up: "));

  // The cause ends: the next try lives.
  REQUIRE(bench.run_until([&] { return bench.status().state == launch::ProcessState::kGivenUp; }));
  std::ofstream(mended) << "yes";
  REQUIRE(bench.run_until([&] { return bench.status().restarts == 7; }));
  ::poll(nullptr, 0, 500);
  bench.supervisor.step(launch::Clock::now());
  CHECK(bench.status().restarts == 7);
  CHECK(bench.status().state == launch::ProcessState::kRunning);
}

TEST_CASE("what was given up and has run for a window is sound again", "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.restart.slow_retry = launch::milliseconds(50);
  const TemporaryDirectory directory;
  const std::string mended = directory / "mended";
  Bench bench({shell("a", "test -e " + mended + " && exec sleep 1000; exit 3")}, parameters);
  bench.supervisor.start({}, launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.status().is_given_up; }));
  std::ofstream(mended) << "yes";
  REQUIRE(bench.run_until([&] { return bench.status().state == launch::ProcessState::kRunning; }));

  // The clock is the caller's: half a minute goes by in steps.
  auto now = launch::Clock::now();
  for (int i = 0; i < 290; ++i) bench.supervisor.step(now += launch::milliseconds(100));
  CHECK(bench.status().is_given_up);
  for (int i = 0; i < 20; ++i) bench.supervisor.step(now += launch::milliseconds(100));
  CHECK_FALSE(bench.status().is_given_up);
  CHECK_THAT(bench.said, Contains("a: has run for 30 s: no longer given up"));
}

TEST_CASE("a pause of the supervisor is no silence of its processes", "[launch]") {
  std::mt19937_64 random(7);
  Bench bench({shell("a", "exec sleep 1000")});
  auto now = launch::Clock::now();
  bench.supervisor.start({}, now);
  const pid_t pid = bench.status().pid;
  bench.supervisor.heartbeat("a", pid, now);

  // Pauses of 0.5 to 60 s; HEALTH comes a second after each, as from a process that goes on.
  for (int i = 0; i < 50; ++i) {
    now += launch::milliseconds(std::uniform_int_distribution<int>(500, 60'000)(random));
    for (int step = 0; step < 10; ++step) {
      bench.supervisor.step(now);
      REQUIRE(bench.status().state == launch::ProcessState::kRunning);
      now += launch::milliseconds(100);
    }
    bench.supervisor.heartbeat("a", pid, now);
    bench.supervisor.step(now);
  }
  CHECK(bench.status().restarts == 0);
  CHECK_THAT(bench.said, Contains("launch: did not run for"));

  // One that is silent beyond the pause hangs all the same.
  now += launch::milliseconds(60'000);
  for (int step = 0; step < 45; ++step) bench.supervisor.step(now += launch::milliseconds(100));
  CHECK(bench.status().state == launch::ProcessState::kDegraded);
  for (int step = 0; step < 15; ++step) bench.supervisor.step(now += launch::milliseconds(100));
  CHECK_THAT(bench.said, Contains("a: hangs: no HEALTH for 5."));
}

TEST_CASE("a pause of the supervisor is no time in which a process was stopped", "[launch]") {
  Bench bench({shell("a", "exec sleep 1000")});
  auto now = launch::Clock::now();
  bench.supervisor.start({}, now);
  const pid_t pid = bench.status().pid;
  ::kill(pid, SIGSTOP);
  REQUIRE(bench.run_until([&] { return bench.status().state == launch::ProcessState::kDegraded; }));

  // Both are frozen for a minute, then go on.
  now = launch::Clock::now() + std::chrono::seconds(60);
  bench.supervisor.step(now);
  ::kill(pid, SIGCONT);
  ::poll(nullptr, 0, 100);
  bench.supervisor.step(now + launch::milliseconds(100));
  CHECK(bench.status().state == launch::ProcessState::kRunning);
  CHECK(bench.status().pid == pid);
}

TEST_CASE("a refused configuration is not tried again", "[launch]") {
  Bench bench({shell("a", "exit 2")});
  bench.supervisor.start({}, launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.supervisor.stopped(); }));
  CHECK(bench.status().restarts == 0);
  CHECK(bench.supervisor.refused() == std::vector<std::string>{"a"});
}

TEST_CASE("a configuration that is refused in a drive is looked at again at a slow pace",
          "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.restart.slow_retry = launch::milliseconds(200);
  const TemporaryDirectory directory;
  const std::string file = directory / "configuration";
  std::ofstream(file) << "fine";
  Bench bench({shell("a", "test -e " + file + " || exit 2; exec sleep 1000")}, parameters);
  bench.supervisor.start({}, launch::Clock::now());
  ::poll(nullptr, 0, 100);  // It has read its configuration.
  std::filesystem::remove(file);
  ::kill(bench.status().pid, SIGKILL);
  REQUIRE(bench.run_until([&] { return bench.status().is_given_up; }));
  CHECK(bench.supervisor.refused().empty());

  std::ofstream(file) << "fine";
  REQUIRE(bench.run_until([&] { return bench.status().state == launch::ProcessState::kRunning; }));
}

TEST_CASE("an executable that is not there is named", "[launch]") {
  Bench bench({{"a", {"/nonexistent/program", {}, {}}}});
  bench.supervisor.start({}, launch::Clock::now());
  CHECK(bench.supervisor.stopped());
  CHECK_THAT(bench.said, Contains("/nonexistent/program"));
}

TEST_CASE("a process that is stopped is degraded, then killed and started again", "[launch]") {
  Bench bench({shell("a", "exec sleep 1000")});
  bench.supervisor.start({}, launch::Clock::now());
  ::kill(bench.status().pid, SIGSTOP);
  REQUIRE(bench.run_until([&] { return bench.status().state == launch::ProcessState::kDegraded; }));
  CHECK(bench.status().restarts == 0);
  REQUIRE(bench.run_until([&] { return bench.status().restarts == 1; }));
  CHECK_THAT(bench.said, Contains("hangs: stopped"));
}

TEST_CASE("silence after heartbeats is a hang, silence from the start is not", "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.silent_degraded = launch::milliseconds(100);
  parameters.silent_restart = launch::milliseconds(200);
  Bench bench({shell("a", "exec sleep 1000"), shell("b", "exec sleep 1000")}, parameters);
  bench.supervisor.start({}, launch::Clock::now());
  bench.supervisor.heartbeat("a", bench.status(0).pid, launch::Clock::now());
  bench.supervisor.heartbeat("b", bench.status(1).pid + 100'000,
                             launch::Clock::now());  // Not its own.
  REQUIRE(bench.run_until([&] { return bench.status(0).restarts == 1; }));
  CHECK(bench.status(1).restarts == 0);
  CHECK_THAT(bench.said, Contains("a: hangs: no HEALTH"));
}

TEST_CASE("a process that was never heard is degraded, and not killed", "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.never_heard_degraded = launch::milliseconds(200);
  parameters.silent_degraded = launch::milliseconds(5000);
  launch::ProcessSpec silent = shell("c", "exec sleep 1000");
  silent.sends_health = false;
  Bench bench({shell("a", "exec sleep 1000"), shell("b", "exec sleep 1000"), silent}, parameters);
  bench.supervisor.start({}, launch::Clock::now());
  bench.supervisor.heartbeat("b", bench.status(1).pid, launch::Clock::now());
  REQUIRE(
      bench.run_until([&] { return bench.status(0).state == launch::ProcessState::kDegraded; }));
  CHECK(bench.status(1).state == launch::ProcessState::kRunning);
  CHECK(bench.status(2).state == launch::ProcessState::kRunning);
  CHECK_THAT(bench.said, Contains("a: DEGRADED: no HEALTH since its start"));

  bench.supervisor.heartbeat("a", bench.status(0).pid, launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.status(0).state == launch::ProcessState::kRunning; }));
  CHECK(bench.status(0).restarts == 0);
}

TEST_CASE("a process that ignores SIGTERM is killed in time", "[launch]") {
  launch::SupervisorParameters parameters;
  parameters.stop_timeout = launch::milliseconds(100);
  Bench bench(
      {shell("a", "trap '' TERM; while :; do sleep 0.01; done"), shell("b", "exec sleep 9")},
      parameters);
  bench.supervisor.start({}, launch::Clock::now());
  bench.run_until([&] { return true; });
  ::poll(nullptr, 0, 100);  // Time to set the trap.
  bench.supervisor.stop(launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.supervisor.stopped(); }));
  CHECK_THAT(bench.said, Contains("a: does not end") && !Contains("b: does not end"));
}

TEST_CASE("who ends last is asked when all others have ended, also those that are late",
          "[launch]") {
  const TemporaryDirectory directory;
  const std::string file = directory / "order";
  // The last one's trap would end it at once; the first one takes its time, another never ends.
  const auto ends = [&](const std::string& name, const std::string& after) {
    return shell(name, "trap '" + after + "echo " + name + " >> " + file +
                           "; exit 0' TERM; while true; do sleep 0.02; done");
  };
  std::vector<launch::ProcessSpec> specs{
      ends("store", ""), ends("mapper", "sleep 0.2; "),
      shell("deaf", "trap '' TERM; while true; do sleep 1; done")};
  specs.front().ends_last = true;
  Bench bench(specs);
  bench.supervisor.start({}, launch::Clock::now());
  ::poll(nullptr, 0, 300);  // The traps are set.

  bench.supervisor.stop(launch::Clock::now());
  REQUIRE(bench.run_until([&] { return bench.supervisor.stopped(); }));
  CHECK(text_of(file) == "mapper\nstore\n");
  CHECK_THAT(bench.said, Contains("deaf: does not end within") && !Contains("store: does not"));
}

TEST_CASE("the next supervisor adopts what still runs", "[launch]") {
  TemporaryDirectory directory;
  pid_t pid = -1;
  Bench first({shell("a", "exec sleep 1000")});
  {
    launch::Registry registry(directory.path());
    first.supervisor.start(registry.read(), launch::Clock::now());
    pid = first.status().pid;
    registry.write(first.supervisor.status());
    CHECK_THROWS_WITH(launch::Registry(directory.path()), Contains("another launch"));
  }
  launch::Registry registry(directory.path());
  Bench second({shell("a", "exec sleep 1000")});
  second.supervisor.start(registry.read(), launch::Clock::now());
  CHECK(second.status().pid == pid);
  CHECK(second.status().restarts == 0);

  // The same number with another start time is somebody else's process.
  auto known = registry.read();
  known.at(0).start_ticks += 1;
  Bench third({shell("a", "exec sleep 1000")});
  third.supervisor.start(known, launch::Clock::now());
  CHECK(third.status().pid != pid);
  CHECK(third.status().restarts == 1);
}

TEST_CASE("launch.toml is refused with file, line and key", "[launch]") {
  TemporaryDirectory directory;
  const auto refused = [&](const std::string& text) -> std::string {
    std::ofstream(directory / "launch.toml") << text;
    try {
      bus::read_launch_config(directory.path());
    } catch (const bus::ConfigurationError& error) {
      return error.what();
    }
    return "accepted";
  };

  const std::string good = "[[process]]\nname = \"a\"\nexecutable = \"x\"\n";
  CHECK(refused(good) == "accepted");
  CHECK_THAT(refused(""), Contains("no [[process]]"));
  CHECK_THAT(refused(good + "colour = 1\n"), Contains("launch.toml:4") && Contains("colour"));
  CHECK_THAT(refused(good + "config = \"none.toml\"\n"), Contains(":4") && Contains("none.toml"));
  CHECK_THAT(refused(good + "arguments = [1]\n"), Contains(":4") && Contains("arguments"));
  CHECK_THAT(refused(good + "is_service = 0\n"), Contains(":4") && Contains("is_service"));
  CHECK_THAT(refused(good + "keeps_state = 1\n"), Contains(":4") && Contains("keeps_state"));
  CHECK_THAT(refused(good + "ends_last = \"yes\"\n"), Contains(":4") && Contains("ends_last"));

  CHECK_THAT(refused(good + good), Contains("twice"));
  CHECK_THAT(refused("[[process]]\nname = \"a\"\n"), Contains("executable"));
  CHECK_THAT(refused("[[process]]\nname = 3\nexecutable = \"x\"\n"), Contains(":2"));
  CHECK_THAT(refused("nonsense = 1\n" + good), Contains(":1") && Contains("nonsense"));
  CHECK_THAT(refused("[[process"), Contains(":1"));

  const std::string tail = "\"\nexecutable = \"x\"\n";
  for (const std::string name : {"../victim", "..", ".", "a/b", "/tmp", "a b", "a\\u001b", "ä"}) {
    CHECK_THAT(refused("[[process]]\nname = \"" + name + tail),
               Contains(":2: name: only letters, digits, _ and -"));
  }
  CHECK(refused("[[process]]\nname = \"Mapper_2-left" + tail) == "accepted");
  CHECK(refused("[[process]]\nname = \"" + std::string(64, 'a') + tail) == "accepted");
  CHECK_THAT(refused("[[process]]\nname = \"" + std::string(65, 'a') + tail),
             Contains(":2: name:"));
}
