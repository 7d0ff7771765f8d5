// `launch` on a bus that it cannot hear, and what it says of processes that cannot speak.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>

#include "common/bus/live_bus.hpp"
#include "common/wire/convert.hpp"
#include "deploy/launch/child_process.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// A UDP port that this process has and does not share.
class TakenPort {
 public:
  TakenPort() : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    REQUIRE(::bind(file_, reinterpret_cast<sockaddr*>(&any), sizeof(any)) == 0);
    socklen_t size = sizeof(any);
    REQUIRE(::getsockname(file_, reinterpret_cast<sockaddr*>(&any), &size) == 0);
    number_ = ntohs(any.sin_port);
  }
  ~TakenPort() { ::close(file_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  int number() const { return number_; }

 private:
  int file_;
  int number_ = 0;
};

/// The system's temporary directory is another one for a while.
class TemporaryFolderOf {
 public:
  explicit TemporaryFolderOf(const std::filesystem::path& folder)
      : before_(std::filesystem::temp_directory_path()) {
    ::setenv("TMPDIR", folder.c_str(), 1);
  }
  ~TemporaryFolderOf() { ::setenv("TMPDIR", before_.c_str(), 1); }
  TemporaryFolderOf(const TemporaryFolderOf&) = delete;
  TemporaryFolderOf& operator=(const TemporaryFolderOf&) = delete;

 private:
  std::filesystem::path before_;
};

/// `launch` in the background, and what is said on its bus.
class RunningLaunch {
 public:
  /// Of one process that runs `script`.
  RunningLaunch(const test::TemporaryDirectory& directory, const std::string& script,
                const std::filesystem::path& state, const std::vector<std::string>& options = {})
      : url_("udpm://239.255.76.67:" + std::to_string(30'000 + ::getpid() % 20'000) + "?ttl=0"),
        bus_(url_) {
    bus_.subscribe("HEALTH", 0, [this](const bus::BusMessage& message) {
      if (const auto one = wire::decode_bytes<health_t>(message.bytes)) health.push_back(*one);
    });
    bus_.subscribe("LOG", 0, [this](const bus::BusMessage& message) {
      if (const auto one = wire::decode_bytes<log_t>(message.bytes)) log.push_back(*one);
    });
    std::ofstream(directory / "launch.toml")
        << "[[process]]\nname = \"a\"\nexecutable = \"/bin/sh\"\narguments = [\"-c\", \"" << script
        << "\"]\nkeeps_state = false\n";
    launch::Command command{UNDERSTORY_COMMAND,
                            {"launch", "--quiet", "--config", directory.path(), "--state-dir",
                             state.string(), "--lcm-url", url_},
                            {}};
    command.arguments.insert(command.arguments.end(), options.begin(), options.end());
    launch_ = launch::ChildProcess::start(command);
  }
  ~RunningLaunch() {
    launch_->signal(SIGTERM);
    wait_until([&] { return launch_->ended().has_value(); });
  }
  RunningLaunch(const RunningLaunch&) = delete;
  RunningLaunch& operator=(const RunningLaunch&) = delete;

  template <class Condition>
  bool wait_until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      bus_.handle_one(10);
    }
    return true;
  }
  const launch::ChildProcess& launch() const { return *launch_; }

  std::vector<health_t> health;
  std::vector<log_t> log;

 private:
  std::string url_;
  bus::LiveBus bus_;
  std::optional<launch::ChildProcess> launch_;
};

}  // namespace

TEST_CASE("a process that is given up is in HEALTH and LOG with the reason", "[cli]") {
  const test::TemporaryDirectory directory;
  RunningLaunch running(directory, "exit 3", directory.path() / "state");
  REQUIRE(running.wait_until([&] { return running.health.size() >= 2; }));
  for (const health_t& one : running.health) {
    CHECK(one.process == "a");
    CHECK(one.pid == 0);
    CHECK(one.state == health_t::STATE_ERROR);
    CHECK(one.last_error_code == "given_up");
    CHECK_THAT(one.last_error, Contains("exited with status 3"));
  }
  CHECK(running.health.at(1).seq == running.health.at(0).seq + 1);
  REQUIRE(running.log.size() == 1);
  CHECK(running.log.front().process == "launch");
  CHECK_THAT(running.log.front().text, Contains("a: given up") && Contains("status 3"));
}

TEST_CASE("launch starts without a state folder that can be written, and says so", "[cli]") {
  const test::TemporaryDirectory directory;
  const TemporaryFolderOf temporary(directory.path());  // Of the spare lock.
  const std::string started = directory / "started";
  // Root may write everywhere, but not below a file.
  std::ofstream(directory / "file") << "no directory";
  const auto state = directory.path() / std::filesystem::path("file") / "state";
  RunningLaunch running(directory, "touch " + started + "; exec sleep 1000", state);
  REQUIRE(running.wait_until([&] { return std::filesystem::exists(started); }));
  REQUIRE(running.wait_until([&] { return !running.log.empty(); }));
  CHECK(running.log.front().code == "state_not_kept");
  CHECK_THAT(running.log.front().text, Contains(state.string()) && Contains("Not a directory"));

  // One launch at a time holds here, too, and the next one adopts what a killed one left.
  const auto second = understory_command(
      directory, "launch --config " + directory.path().string() + " --state-dir " + state.string());
  CHECK(second.status == 1);
  CHECK_THAT(second.error, Contains("another launch is running with this state"));
}

TEST_CASE("launch and doctor name a port of the sweeps' group that another program has", "[cli]") {
  const TakenPort port;
  const test::TemporaryDirectory directory;
  const auto outcome = understory_command(
      directory, "launch --config " UNDERSTORY_SOURCE_CONFIG " --only keyframer --state-dir " +
                     (directory / "state").string() + " --lcm-url 'udpm://239.255.76.67:" +
                     std::to_string(port.number() - 1) + "?ttl=0'");
  CAPTURE(outcome.error);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error,
             Contains(":" + std::to_string(port.number())) && Contains("is taken by `test_cli`"));

  const auto findings = understory_command(
      directory,
      "doctor --lcm-url 'udpm://239.255.76.67:" + std::to_string(port.number() - 1) + "?ttl=0'");
  CHECK(findings.status == 1);
  CHECK_THAT(findings.out, Contains("multicast of sweeps") && Contains("is taken by `test_cli`"));
}

TEST_CASE("launch --fresh deletes saved state and nothing else, behind a link as well", "[cli]") {
  const test::TemporaryDirectory directory;
  const std::filesystem::path state = directory / "state";
  const std::filesystem::path elsewhere = directory / "elsewhere";
  const std::vector<std::string> ours{"a.snapshot",     "a.snapshot.new", "a.snapshot.damaged",
                                      "a.journal.12",   "a.recovering",   "a.journal.0.damaged",
                                      "given_map.toml", "b-2_c.snapshot"};
  const std::vector<std::string> others{"thesis.txt", "photos/snapshot", "snapshot",
                                        ".journal.1", "a.journal.old",   "a.snapshot.bak",
                                        "a.snapshots"};
  std::filesystem::create_directories(state);
  std::filesystem::create_directories(elsewhere / "photos");
  for (const auto& names : {ours, others})
    for (const std::string& name : names) std::ofstream(elsewhere / name) << "precious";
  std::filesystem::create_directory_symlink(elsewhere, state / "a");

  const std::string started = directory / "started";
  RunningLaunch running(directory, "touch " + started + "; exec sleep 1000", state, {"--fresh"});
  REQUIRE(running.wait_until([&] { return std::filesystem::exists(started); }));
  for (const std::string& name : ours) {
    CAPTURE(name);
    CHECK_FALSE(std::filesystem::exists(elsewhere / name));
  }
  for (const std::string& name : others) {
    CAPTURE(name);
    CHECK(test::read_text(elsewhere / name) == "precious");
  }
}

TEST_CASE("launch --fresh on a port that another program has deletes nothing", "[cli]") {
  const TakenPort port;
  const test::TemporaryDirectory directory;
  const auto kept = directory.path() / "state" / "keyframer" / "snapshot";
  std::filesystem::create_directories(kept.parent_path());
  std::ofstream(kept) << "the map";

  const auto outcome = understory_command(
      directory, "launch --fresh --config " UNDERSTORY_SOURCE_CONFIG
                 " --only keyframer "
                 "--state-dir " +
                     (directory / "state").string() + " --lcm-url '" +
                     "udpm://239.255.76.67:" + std::to_string(port.number()) + "?ttl=0'");
  CAPTURE(outcome.error);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error, Contains("is taken by `test_cli`"));
  CHECK(test::read_text(kept) == "the map");
}
