// A writing process is killed.
#include <csignal>
#include <map>

#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// What the change of this number puts in; of the same seed always the same.
StoredMap map_of_change(std::uint64_t number) {
  std::mt19937_64 random(1000 + number);
  return random_map(static_cast<std::uint32_t>(1 + number % 3), random, 150);
}

/// Writes change after change until it is killed; a byte into the pipe for each that is finished.
[[noreturn]] void write_for_ever(const std::filesystem::path& file, int pipe) {
  try {
    if (!std::filesystem::exists(file)) {
      const StoredMap first = map_of_change(1);
      map_file::create_map_file(file, {&first, 1}, note("made"));
      if (::write(pipe, "+", 1) != 1) ::_exit(1);
    }
    for (;;) {
      MapFile opened(file, Access::kWrite);
      // Closing is a moment of its own: every few changes.
      for (int i = 0; i < 4; ++i) {
        const StoredMap map = map_of_change(opened.history().size() + 1);
        opened.put({&map, 1}, note("put"));
        if (::write(pipe, "+", 1) != 1) ::_exit(1);
      }
    }
  } catch (...) {
    ::_exit(2);
  }
}

/// Starts the writer, lets it finish so many changes, and kills it after the delay; gives how many
/// it finished.
std::uint64_t finished_before_death(const std::filesystem::path& file, int changes, int delay_us) {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) write_for_ever(file, ends[1]);
  ::close(ends[1]);

  std::uint64_t finished = 0;
  char c = 0;
  for (; changes > 0 && ::read(ends[0], &c, 1) == 1; --changes) ++finished;
  ::usleep(static_cast<useconds_t>(delay_us));
  ::kill(child, SIGKILL);
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));

  while (::read(ends[0], &c, 1) == 1) ++finished;
  ::close(ends[0]);
  return finished;
}

/// All changes up to `count` are there, whole, and nothing else.
void check_changes(const MapFile& opened, std::uint64_t count) {
  const std::vector<std::string> findings = opened.check();
  CAPTURE(count, findings);
  CHECK(findings.empty());
  std::map<std::uint32_t, std::uint64_t> latest;
  for (std::uint64_t number = 1; number <= count; ++number)
    latest[map_of_change(number).map_id] = number;
  REQUIRE(opened.maps().size() == latest.size());
  for (const auto& [id, number] : latest) CHECK(same(opened.read(id), map_of_change(number)));
}

void kill_again_and_again(int times, std::uint64_t seed) {
  const TemporaryDirectory directory;
  std::filesystem::path file;
  std::mt19937_64 random(seed);
  std::uint64_t before = 0;
  std::uint64_t in_flight = 0;
  std::uint64_t in_all = 0;
  for (int i = 0; i < times; ++i) {
    // A new file now and then: its making is killed, too.
    if (i % 10 == 0) {
      file = directory / fmt::format("maps-{}.gpkg", i);
      before = 0;
    }
    const int changes = static_cast<int>(random() % 5);
    const int delay_us = static_cast<int>(random() % 15'000);
    const std::uint64_t finished = finished_before_death(file, changes, delay_us);
    CAPTURE(i, before, finished);
    if (!std::filesystem::exists(file)) {
      CHECK(finished == 0);
      continue;
    }

    const MapFile opened(file, Access::kRead);
    const std::uint64_t count = opened.history().size();
    CHECK(count >= before + finished);
    CHECK(count <= before + finished + 1);
    in_flight += count - before - finished;
    in_all += finished;
    check_changes(opened, count);
    before = count;
  }
  WARN(fmt::format("{} kills: {} changes reported, all there; {} more were whole", times, in_all,
                   in_flight));
}

}  // namespace

TEST_CASE("killed at any moment, a file has every change that was finished", "[map_file]") {
  kill_again_and_again(50, 16);
}

TEST_CASE("killed two hundred times", "[.long]") { kill_again_and_again(200, 17); }
