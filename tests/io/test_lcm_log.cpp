#include <sys/stat.h>

#include <algorithm>

#include "tests/catch.hpp"
#include "tests/data.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using namespace understory::io;
using namespace understory::test;

TEST_CASE("a log reads as it was written", "[log]") {
  test::TemporaryDirectory directory;
  std::mt19937_64 random(1);
  auto events = test::random_events(300, random);
  events[7].data.assign(3'000'000, 0xED);  // Larger than the reader's buffer.
  events[8].number = INT64_MAX;
  events[9].utime = -5;
  test::write_log(directory / "a.lcm", events);

  LcmLogReader reader(directory / "a.lcm");
  const auto read = test::read_log(reader);
  REQUIRE(read.size() == events.size());
  for (std::size_t i = 0; i < events.size(); ++i) CHECK(test::same(read[i], events[i]));
  CHECK(reader.damage().places == 0);
  CHECK(reader.damage().bytes == 0);
  CHECK(reader.position_bytes() == reader.size_bytes());
}

TEST_CASE("the bytes are those of the format", "[log]") {
  test::TemporaryDirectory directory;
  test::write_log(directory / "a.lcm", {{1, 0x0102030405060708, "AB", {0x7F}}});
  const test::Bytes expected{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0, 0, 1, 1,   2,   3,   4,
                             5,    6,    7,    8,    0, 0, 0, 2, 0, 0, 0, 1, 'A', 'B', 0x7F};
  CHECK(read_bytes(directory / "a.lcm") == expected);
}

TEST_CASE("events number themselves when asked to", "[log]") {
  test::TemporaryDirectory directory;
  const test::Bytes data{1, 2, 3};
  {
    LcmLogWriter writer(directory / "a.lcm");
    for (int i = 0; i < 3; ++i) writer.write(i * 10, "C", data);
    writer.commit();
  }
  LcmLogReader reader(directory / "a.lcm");
  for (int i = 0; i < 3; ++i) CHECK(test::same(reader.next().value(), {i, i * 10, "C", data}));
  CHECK_FALSE(reader.next());
}

TEST_CASE("an empty log has no events and no damage", "[log]") {
  test::TemporaryDirectory directory;
  test::write_log(directory / "a.lcm", {});
  LcmLogReader reader(directory / "a.lcm");
  CHECK_FALSE(reader.next());
  CHECK(reader.damage().places == 0);
}

TEST_CASE("a log appears whole or not at all", "[log]") {
  test::TemporaryDirectory directory;
  const auto path = directory / "a.lcm";
  {
    LcmLogWriter writer(path);
    writer.write(0, "C", test::Bytes{1});
    CHECK_FALSE(std::filesystem::exists(path));
  }
  CHECK(std::filesystem::is_empty(directory.path()));

  test::write_log(path, {{0, 0, "OLD", {}}});
  const auto before = read_bytes(path);
  { LcmLogWriter writer(path); }
  CHECK(read_bytes(path) == before);
  test::write_log(path, {{0, 0, "NEW", {}}});
  CHECK(read_bytes(path) != before);
  struct stat status {};
  REQUIRE(::stat(path.c_str(), &status) == 0);
  CHECK((status.st_mode & 0400U) != 0);
}

TEST_CASE("errors name the file", "[log]") {
  using Catch::Matchers::Contains;
  test::TemporaryDirectory directory;
  CHECK_THROWS_WITH(LcmLogReader(directory / "none.lcm"), Contains("none.lcm"));
  CHECK_THROWS_WITH(LcmLogReader(directory.path()), Contains("not a regular file"));
  CHECK_THROWS_WITH(LcmLogWriter(directory / "none" / "a.lcm"), Contains("none/a.lcm"));

  LcmLogWriter writer(directory / "a.lcm");
  CHECK_THROWS_WITH(writer.write(0, "", test::Bytes{}), Contains("a.lcm") && Contains("channel"));
  CHECK_THROWS_WITH(writer.write(0, std::string(64, 'C'), test::Bytes{}), Contains("channel"));
  CHECK_NOTHROW(writer.write(0, std::string(63, 'C'), test::Bytes{}));
}

TEST_CASE("a full disk is reported and the device stays what it is", "[log]") {
  LcmLogWriter writer("/dev/full");
  const auto fill = [&] {
    for (int i = 0; i < 100; ++i) writer.write(0, "C", test::Bytes(10'000, 1));
    writer.commit();
  };
  CHECK_THROWS_WITH(fill(), Catch::Matchers::Contains("/dev/full: cannot write: No space"));
  CHECK(std::filesystem::is_character_file("/dev/full"));
}

TEST_CASE("recorded logs of other people's robots are read whole", "[log][recorded]") {
  const auto folder = test::recording("lcm_logs");
  const std::pair<const char*, std::size_t> logs[] = {{"mbot_drive_square.lcm", 45'246},
                                                      {"gokart_vlp16_rimo.lcm", 161},
                                                      {"gokart_vlp16_pos.lcm", 11}};
  for (const auto& [name, count] : logs) {
    LcmLogReader reader(folder / name);
    const auto events = test::read_log(reader);
    CHECK(events.size() == count);
    CHECK(reader.damage().places == 0);
    test::TemporaryDirectory directory;
    test::write_log(directory / name, events);
    CHECK(read_bytes(directory / name) == read_bytes(folder / name));
  }
}
