#include <algorithm>
#include <chrono>

#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using namespace understory::io;
using namespace understory::test;

namespace {

struct Damaged {
  std::vector<LogEvent> events;
  LogDamage damage;
};

Damaged read_damaged(const test::TemporaryDirectory& directory, const test::Bytes& bytes) {
  write_bytes(directory / "damaged.lcm", bytes);
  LcmLogReader reader(directory / "damaged.lcm");
  Damaged result{test::read_log(reader), {}};
  result.damage = reader.damage();
  return result;
}

/// How many of `read` are not, field for field, among `written`.
std::size_t strangers(const std::vector<LogEvent>& read, const std::vector<LogEvent>& written) {
  return static_cast<std::size_t>(
      std::count_if(read.begin(), read.end(), [&](const LogEvent& event) {
        return std::none_of(written.begin(), written.end(),
                            [&](const LogEvent& other) { return test::same(event, other); });
      }));
}

struct Fixture {
  test::TemporaryDirectory directory;
  std::mt19937_64 random{7};
  std::vector<LogEvent> events = test::random_events(40, random);
  std::vector<std::size_t> starts = test::offsets(events);
  test::Bytes bytes;
  Fixture() {
    test::write_log(directory / "whole.lcm", events);
    bytes = read_bytes(directory / "whole.lcm");
  }
};

}  // namespace

TEST_CASE_METHOD(Fixture, "a damaged header costs its own event at most", "[log]") {
  // Bytes of the magic and of the two lengths; a wrong number or time looks like a good one.
  for (std::size_t victim = 0; victim < events.size(); ++victim) {
    for (const std::size_t byte : {0U, 1U, 2U, 3U, 20U, 21U, 22U, 23U, 24U, 25U, 26U, 27U}) {
      for (const std::uint8_t flip : {0x01, 0x02, 0x80, 0xFF}) {
        test::Bytes damaged = bytes;
        damaged[starts[victim] + byte] ^= flip;
        const auto result = read_damaged(directory, damaged);
        CAPTURE(victim, byte, int{flip});
        REQUIRE(result.events.size() == events.size() - 1);
        REQUIRE(strangers(result.events, events) == 0);
        REQUIRE(result.damage.places == 1);
        REQUIRE(result.damage.bytes == starts[victim + 1] - starts[victim]);
        REQUIRE(result.damage.last_offset == starts[victim]);
        REQUIRE(result.damage.events_lost == (victim + 1 < events.size() ? 1 : 0));
      }
    }
  }
}

TEST_CASE_METHOD(Fixture, "cut anywhere, what is whole before the cut is read", "[log]") {
  for (std::size_t length = 0; length < bytes.size(); length += 13) {
    const auto result = read_damaged(directory, {bytes.begin(), bytes.begin() + length});
    const auto whole = static_cast<std::size_t>(
        std::upper_bound(starts.begin(), starts.end(), length) - starts.begin() - 1);
    CAPTURE(length);
    REQUIRE(result.events.size() == whole);
    REQUIRE(strangers(result.events, events) == 0);
    REQUIRE(result.damage.bytes == length - starts[whole]);
  }
}

TEST_CASE_METHOD(Fixture, "a stretch taken out costs the events that it touches", "[log]") {
  std::uniform_int_distribution<std::size_t> place(0, bytes.size() - 600);
  std::uniform_int_distribution<std::size_t> length(1, 600);
  for (int run = 0; run < 200; ++run) {
    const std::size_t from = place(random);
    const std::size_t to = from + length(random);
    test::Bytes damaged(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(from));
    damaged.insert(damaged.end(), bytes.begin() + static_cast<std::ptrdiff_t>(to), bytes.end());
    std::size_t untouched = 0;

    for (std::size_t i = 0; i < events.size(); ++i) {
      untouched += starts[i + 1] <= from || starts[i] >= to ? 1 : 0;
    }

    const auto result = read_damaged(directory, damaged);
    CAPTURE(from, to);

    // A stretch may begin and end inside two payloads so that they join: one more event then.
    REQUIRE(result.events.size() + 1 >= untouched);
    REQUIRE(result.events.size() <= untouched + 1);
    REQUIRE(strangers(result.events, events) <= 1);
  }
}

TEST_CASE_METHOD(Fixture, "garbage between events is skipped and counted exactly", "[log]") {
  std::uniform_int_distribution<int> byte(0, 255);
  for (std::size_t victim = 0; victim <= events.size(); ++victim) {
    test::Bytes garbage(777);
    for (auto& value : garbage) value = static_cast<std::uint8_t>(byte(random));
    garbage[0] = 0;  // No magic by chance.
    test::Bytes damaged = bytes;
    damaged.insert(damaged.begin() + static_cast<std::ptrdiff_t>(starts[victim]), garbage.begin(),
                   garbage.end());
    const auto result = read_damaged(directory, damaged);
    CAPTURE(victim);

    // Without a header behind it the event before the garbage is not beyond doubt.
    REQUIRE(result.events.size() + 1 >= events.size());
    REQUIRE(strangers(result.events, events) == 0);
    REQUIRE(result.damage.places == 1);
    REQUIRE(result.damage.bytes >= garbage.size());
  }
}

TEST_CASE_METHOD(Fixture, "a log inside a message is not mistaken for the log", "[log]") {
  events[5].data = bytes;
  test::write_log(directory / "nested.lcm", events);
  LcmLogReader reader(directory / "nested.lcm");
  const auto read = test::read_log(reader);
  REQUIRE(read.size() == events.size());
  CHECK(test::same(read[5], events[5]));
  CHECK(reader.damage().places == 0);
}

TEST_CASE_METHOD(Fixture, "hostile lengths allocate nothing and end", "[log]") {
  // Headers that claim 2 GiB, each of a magic that a search must look at.
  test::Bytes hostile;
  for (int i = 0; i < 20'000; ++i) {
    const test::Bytes header{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0,    0,    0,    0,    0,  0,
                             0,    0,    0,    0,    0, 0, 0, 0, 1, 0x7F, 0xFF, 0xFF, 0xFF, 'C'};
    hostile.insert(hostile.end(), header.begin(), header.end());
  }
  auto result = read_damaged(directory, hostile);
  CHECK(result.events.empty());
  CHECK(result.damage.bytes == hostile.size());
  CHECK(result.damage.places == 1);

  // Headers whose claims lie inside the file but lead nowhere: linear, not quadratic.
  for (std::size_t i = 0; i < hostile.size(); i += 29) {
    hostile[i + 24] = 0;
    hostile[i + 25] = 0x01;
  }
  result = read_damaged(directory, hostile);
  CHECK(result.damage.bytes + 29 * result.events.size() <= hostile.size() + 29);
}

TEST_CASE_METHOD(Fixture, "random damage never invents sizes or fails", "[log]") {
  std::uniform_int_distribution<std::size_t> place(0, bytes.size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int run = 0; run < 2000; ++run) {
    test::Bytes damaged = bytes;
    const int hits = 1 + run % 50;
    for (int i = 0; i < hits; ++i) damaged[place(random)] = static_cast<std::uint8_t>(byte(random));
    const auto result = read_damaged(directory, damaged);
    std::size_t read_bytes = 0;
    for (const auto& event : result.events) {
      read_bytes += 28 + event.channel.size() + event.data.size();
    }
    REQUIRE(read_bytes + result.damage.bytes == damaged.size());
    REQUIRE(result.events.size() + static_cast<std::size_t>(2 * hits) >= events.size());
  }
}

TEST_CASE_METHOD(Fixture, "holes of a file cost no time, and what is behind them is found",
                 "[log]") {
  constexpr std::uintmax_t kGiB = std::uintmax_t{1} << 30U;
  const auto file = directory / "sparse.lcm";
  const auto start = std::chrono::steady_clock::now();
  for (const std::uintmax_t hole : {std::uintmax_t{1}, kGiB - 1, 100 * kGiB + 5}) {
    // The log, the hole, the log again; numbers begin anew.
    write_bytes(file, bytes);
    std::filesystem::resize_file(file, bytes.size() + hole);
    std::ofstream(file, std::ios::binary | std::ios::app)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    LcmLogReader reader(file);
    const auto read = test::read_log(reader);
    CAPTURE(hole);
    // The event in front of a hole is not beyond doubt.
    CHECK(read.size() + 1 >= 2 * events.size());
    CHECK(strangers(read, events) == 0);
    CHECK(reader.damage().places == 1);
    CHECK(reader.damage().bytes >= hole);
  }

  // Nothing but a hole is another kind of file.
  write_bytes(file, {});
  std::filesystem::resize_file(file, 1000 * kGiB);
  LcmLogReader reader(file);
  CHECK_FALSE(reader.next());
  CHECK_THROWS_WITH(reader.refuse_other_files(), Catch::Matchers::Contains("no LCM log"));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(20));
}
