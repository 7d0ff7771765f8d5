// State over restarts: snapshot and journal, cut and damaged everywhere.
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <thread>

#include "common/bus/node_state.hpp"
#include "common/bus/state_format.hpp"
#include "tests/bus/toy_life.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
void write(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace

TEST_CASE("a killed service goes on as if nothing had happened, whenever it is killed") {
  const auto expected = uninterrupted(60);
  const std::string toml =
      GENERATE(as<std::string>(), "", "[runtime]\nsnapshot_every_events = 7\n",
               "[runtime]\nsnapshot_every_s = 0.5\n", "[runtime]\nsnapshot_every_events = 1\n");
  for (int killed = 1; killed < 60; killed += 4) {
    const test::Scratch scratch("state");
    Life(scratch.path(), toml).run(0, killed);
    Life second(scratch.path(), toml);
    CHECK(second.is_recovered);
    CHECK(second.poses.empty());  // what was published before is not published again
    second.run(killed, 60);
    REQUIRE(second.poses.size() == static_cast<std::size_t>(60 - killed));
    for (std::size_t i = 0; i < second.poses.size(); ++i) {
      CHECK(wire::encode_bytes(second.poses[i]) ==
            wire::encode_bytes(expected[static_cast<std::size_t>(killed) + i]));
    }
  }
}

TEST_CASE("a device that takes long to flush keeps no input waiting, and nothing is lost") {
  const auto expected = uninterrupted(60);
  const test::Scratch scratch("state-slow");
  // Whoever opens it to write waits until somebody reads: a device that hangs.
  const fs::path slow = scratch.path() / "toy.snapshot.new";
  REQUIRE(::mkfifo(slow.c_str(), 0600) == 0);
  Life life(scratch.path(), "[runtime]\nsnapshot_every_events = 5\n", no_clock(),
            StateStore::Saving::kBeside);
  life.run(0, 23);
  CHECK(life.poses.size() == 23);
  CHECK(life.store.is_saving());
  CHECK_FALSE(fs::exists(scratch.path() / "toy.snapshot"));

  // Killed now: what the process would leave behind.
  const test::Scratch left("state-slow-left");
  for (const char* const file : {"toy.journal.0", "toy.journal.1"})
    fs::copy(scratch.path() / file, left.path() / file);
  Life second(left.path());
  CHECK(second.is_recovered);
  second.run(23, 60);
  REQUIRE(second.poses.size() == 37);
  CHECK(wire::encode_bytes(second.poses.back()) == wire::encode_bytes(expected.back()));

  // The device answers, with an error: a pipe cannot be flushed. The next snapshot is kept.
  std::ifstream(slow, std::ios::binary).ignore(std::numeric_limits<std::streamsize>::max());
  for (int i = 23; i < 60 || !fs::exists(scratch.path() / "toy.snapshot"); ++i) {
    REQUIRE(i < 6000);
    life.run(i, i + 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(life.hosted.node().monitor().count_of("", wire::Reason::kStateNotKept) == 1);
  CHECK_FALSE(fs::exists(scratch.path() / "toy.journal.0"));
}

TEST_CASE("what follows a hole in the journal is not repeated") {
  const test::Scratch scratch("state-hole");
  const auto channels = [&] {
    const test::Scratch copy("state-hole-copy");
    fs::copy(scratch.path(), copy.path(), fs::copy_options::recursive);
    StateStore store(copy.path(), "toy");
    std::string all;
    for (const JournalEvent& event : store.open().events) all += event.channel;
    return all;
  };
  const std::array<std::uint8_t, 1> bytes{1};
  StateStore store(scratch.path(), "toy");
  store.open();
  store.end_recovery();
  REQUIRE_FALSE(store.append("A", bytes));

  // The device fails: no further journal can be made.
  fs::create_directory(scratch.path() / "toy.journal.1");
  CHECK(store.save("state"));
  CHECK(store.needs_snapshot());
  CHECK(store.append("B", bytes));
  CHECK(channels() == "A");

  // Journals can be made again, snapshots cannot.
  fs::create_directory(scratch.path() / "toy.snapshot.new");
  CHECK(store.save("state"));
  CHECK_FALSE(store.append("C", bytes));
  CHECK(channels() == "A");
  for (int i = 0; i < 20; ++i) CHECK(store.save("state"));
  CHECK_FALSE(store.append("D", bytes));
  CHECK(channels() == "A");
  const auto files = std::distance(fs::directory_iterator(scratch.path()), {});
  CHECK(files <= 5);  // lock, the folder in the way, journals of before and of now

  // All is well again.
  fs::remove(scratch.path() / "toy.snapshot.new");
  CHECK_FALSE(store.save("state"));
  CHECK_FALSE(store.append("E", bytes));
  CHECK(channels() == "E");
}

TEST_CASE("a journal cut at every byte gives every whole event before the cut") {
  const auto expected = uninterrupted(9);
  const test::Scratch scratch("state");
  Life(scratch.path()).run(0, 8);
  const fs::path file = scratch.path() / "toy.journal.0";
  const std::string journal = read(file);
  std::size_t one = journal.size() / 8;
  REQUIRE(one * 8 == journal.size());

  for (std::size_t size = 0; size <= journal.size(); ++size) {
    write(file, journal.substr(0, size));
    Life life(scratch.path());
    CHECK(life.is_recovered);
    const auto whole = static_cast<int>(size / one);
    life.run(whole, whole + 1);
    REQUIRE(life.poses.size() == 1);
    CHECK(life.poses[0].odom_T_vehicle.x ==
          expected[static_cast<std::size_t>(whole)].odom_T_vehicle.x);
  }
}

TEST_CASE("a damaged byte anywhere in journal or snapshot is reported, never loaded") {
  const test::Scratch scratch("state");
  Life(scratch.path(), "[runtime]\nsnapshot_every_events = 5\n").run(0, 8);
  const fs::path snapshot_file = scratch.path() / "toy.snapshot";
  const fs::path journal_file = scratch.path() / "toy.journal.1";
  const std::string snapshot = read(snapshot_file);
  const std::string journal = read(journal_file);
  REQUIRE(journal.size() > 0);

  std::mt19937_64 random(1);
  for (const bool in_snapshot : {true, false}) {
    const std::string& whole = in_snapshot ? snapshot : journal;
    for (std::size_t at = 0; at < whole.size(); at += in_snapshot ? 1 : 3) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ static_cast<char>(1 + random() % 255));
      write(snapshot_file, in_snapshot ? damaged : snapshot);
      write(journal_file, in_snapshot ? journal : damaged);
      StateStore store(scratch.path(), "toy");
      const auto recovered = store.open();
      store.end_recovery();

      if (in_snapshot) {
        CHECK_FALSE(recovered.snapshot);
        CHECK(recovered.events.empty());
        REQUIRE(recovered.problems.size() == 1);
        CHECK(recovered.problems[0].reason == wire::Reason::kSnapshotDamaged);
      } else {
        REQUIRE(recovered.snapshot);
        CHECK(recovered.events.size() < 3);
        for (std::size_t i = 0; i < recovered.events.size(); ++i) {
          CHECK(recovered.events[i].bytes ==
                wire::encode_message(test::toy_input(5 + static_cast<int>(i))));
        }
      }

      for (const auto& entry : fs::directory_iterator(scratch.path())) fs::remove(entry.path());
    }
  }
}

TEST_CASE("a state that the stage cannot load is refused and reported") {
  const test::Scratch scratch("state");
  StateStore(scratch.path(), "toy").open();
  {
    StateStore store(scratch.path(), "toy");
    store.open();
    NodeState state;
    state.now_us = 5;
    state.timers_due_us = {-1};
    state.stage = "rubbish";
    REQUIRE_FALSE(store.save(state::save(NodeState::kFormat, state)));
  }
  Life life(scratch.path());
  CHECK_FALSE(life.is_recovered);
  CHECK(life.hosted.node().monitor().count_of("", wire::Reason::kSnapshotDamaged) == 1);
}

TEST_CASE("a recovery that keeps dying is not tried for ever") {
  const test::Scratch scratch("state");
  Life(scratch.path(), "[runtime]\nsnapshot_every_events = 5\n").run(0, 8);
  std::vector<std::size_t> events;
  std::vector<bool> has_snapshot;
  for (int death = 0; death < 5; ++death) {
    StateStore store(scratch.path(), "toy");
    const auto recovered = store.open();  // and dies before end_recovery
    events.push_back(recovered.events.size());
    has_snapshot.push_back(recovered.snapshot.has_value());
  }
  CHECK(events == std::vector<std::size_t>{3, 3, 0, 0, 0});
  CHECK(has_snapshot == std::vector<bool>{true, true, true, true, false});
}

TEST_CASE("a directory that cannot be written is reported, and the service runs on") {
  Life life("/proc/no-such-directory");
  life.run(0, 5);
  CHECK(life.poses.size() == 5);
  CHECK(life.hosted.node().monitor().count_of("", wire::Reason::kStateNotKept) > 0);
}

TEST_CASE("a state that is not kept is a condition, and kept again when the device comes back") {
  const auto expected = uninterrupted(60);
  for (const int mended : {1, 7, 30, 59}) {
    const test::Scratch scratch("state");
    const fs::path device = scratch.path() / "device";
    write(device, "no directory");  // Root may write everywhere, but not below a file.
    std::int64_t now = 0;
    const Clock clock{[&] { return now; }, [&] { return now; }};
    {
      Life life(device / "state", "", clock);
      life.run(0, mended);
      CHECK(life.poses.size() == static_cast<std::size_t>(mended));
      now += 1'000'000'000;  // What was only counted is not fresh any more.
      CHECK(life.hosted.node().monitor().state() == health_t::STATE_DEGRADED);
      const health_t health = life.hosted.node().health();
      CHECK(health.last_error_code == "state_not_kept");
      CHECK_THAT(health.last_error, Catch::Matchers::Contains((device / "state").string()) &&
                                        Catch::Matchers::Contains("Not a directory"));

      // It comes back; within a second of message time the state is kept, and nothing is lost.
      fs::remove(device);
      life.run(mended, mended + 11);
      now += 1'000'000'000;
      CHECK(life.hosted.node().monitor().state() == health_t::STATE_OK);
    }
    Life second(device / "state");
    CHECK(second.is_recovered);
    second.run(mended + 11, mended + 12);
    REQUIRE(second.poses.size() == 1);
    if (mended + 11 < 60) {
      CHECK(wire::encode_bytes(second.poses[0]) ==
            wire::encode_bytes(expected[static_cast<std::size_t>(mended) + 11]));
    }
  }
}

TEST_CASE("a symbolic link in place of a state file is not followed") {
  const std::string file = GENERATE(as<std::string>(), "toy.journal.0", "toy.snapshot",
                                    "toy.snapshot.new", "toy.recovering", "toy.lock");
  CAPTURE(file);
  const test::Scratch scratch("state-link");
  const test::Scratch elsewhere("state-victim");
  const fs::path victim = elsewhere.path() / "victim";
  write(victim, "precious");
  fs::create_symlink(victim, scratch.path() / file);

  StateStore store(scratch.path(), "toy");
  const StateStore::Recovered recovered = store.open();
  REQUIRE_FALSE(recovered.problems.empty());
  CHECK(recovered.problems.front().reason == wire::Reason::kStateNotKept);
  CHECK(recovered.problems.front().detail.find(file) != std::string::npos);
  CHECK_FALSE(recovered.snapshot);
  CHECK(recovered.events.empty());
  store.end_recovery();

  // Inputs and a snapshot go nowhere near it either.
  store.append("ODOMETRY", std::array<std::uint8_t, 3>{1, 2, 3});
  store.save("state");
  CHECK(read(victim) == "precious");
}

TEST_CASE("one process at a time keeps its state in a directory") {
  const test::Scratch scratch("state-lock");
  {
    StateStore first(scratch.path(), "toy");
    first.open();
    StateStore second(scratch.path(), "toy");
    CHECK_THROWS_WITH(second.open(),
                      Catch::Matchers::EndsWith("another process keeps its state here"));
    CHECK_THROWS(second.start_over());
    StateStore other_service(scratch.path(), "other");
    CHECK_NOTHROW(other_service.open());
  }
  CHECK_NOTHROW(StateStore(scratch.path(), "toy").open());
}

TEST_CASE("a killed process leaves no lock behind") {
  const test::Scratch scratch("state-killed");
  std::array<int, 2> ready{};
  REQUIRE(::pipe(ready.data()) == 0);
  const pid_t child = ::fork();
  if (child == 0) {
    StateStore store(scratch.path(), "toy");
    store.open();
    const char byte = 'x';
    if (::write(ready[1], &byte, 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }
  char byte = 0;
  REQUIRE(::read(ready[0], &byte, 1) == 1);
  CHECK_THROWS(StateStore(scratch.path(), "toy").open());

  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  CHECK_NOTHROW(StateStore(scratch.path(), "toy").open());
  ::close(ready[0]);
  ::close(ready[1]);
}
