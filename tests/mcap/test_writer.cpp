#include <filesystem>
#include <random>

#include "common/io/data_error.hpp"
#include "common/mcap/writer.hpp"
#include "tests/catch.hpp"
#include "tests/mcap/mcap_reader.hpp"
#include "tests/scratch.hpp"

namespace understory::mcap {
namespace {

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

/// Messages of three channels at random times, some of them empty.
std::vector<std::pair<Message, std::string>> random_messages(std::size_t count) {
  std::mt19937_64 random(5);
  std::vector<std::pair<Message, std::string>> result;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string data(random() % 200, static_cast<char>('a' + i % 26));
    const std::uint64_t time = random() % 1'000'000'000;
    result.push_back({{static_cast<std::uint16_t>(1 + random() % 3), i, time, time / 2, {}}, data});
  }
  return result;
}

TEST_CASE("what was written is read back, and every offset, count and checksum is right") {
  const test::Scratch scratch("mcap");
  const std::string path = scratch.path() / "run.mcap";
  const auto messages = random_messages(3000);
  const bool compresses = GENERATE(true, false);
  {
    Writer writer(path, {"", "test", 8192, compresses});
    const auto schema = writer.add(Schema{"foxglove.Log", "jsonschema", "{}"});
    writer.add(Schema{"unused", "jsonschema", "{}"});
    for (const char* topic : {"/a", "/b", "/c", "/unused"}) {
      writer.add(Channel{schema, topic, "json", {{"key", "value"}}});
    }
    for (auto [message, data] : messages) {
      message.data = data;
      writer.write(message);
    }
    REQUIRE_FALSE(std::filesystem::exists(path));
    writer.commit();
  }

  const test::McapFile file = test::read_mcap(test::bytes_of(path));
  REQUIRE(file.library == "test");
  REQUIRE(file.schemas.size() == 1);
  REQUIRE(file.channels.size() == 3);
  REQUIRE(file.chunks > 10);
  REQUIRE(file.messages.size() == messages.size());
  for (std::size_t i = 0; i < messages.size(); ++i) {
    REQUIRE(file.messages[i].sequence == messages[i].first.sequence);
    REQUIRE(file.messages[i].log_time == messages[i].first.log_time_ns);
    REQUIRE(file.messages[i].publish_time == messages[i].first.publish_time_ns);
    REQUIRE(file.messages[i].data == messages[i].second);
  }
}

TEST_CASE("the small reader finds every changed byte of the structure") {
  const test::Scratch scratch("mcap");
  const std::string path = scratch.path() / "run.mcap";
  {
    Writer writer(path, {"", "", 500, false});
    const auto schema = writer.add(Schema{"S", "jsonschema", "{}"});
    writer.add(Channel{schema, "/a", "json", {}});
    for (std::uint32_t i = 0; i < 20; ++i) writer.write({1, i, i, i, "{\"value\":1}"});
    writer.commit();
  }
  const std::string whole = test::bytes_of(path);
  REQUIRE(test::read_mcap(whole).messages.size() == 20);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    INFO("byte " << i << " of " << whole.size());
    REQUIRE_THROWS(test::read_mcap(changed));
  }
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    REQUIRE_THROWS(test::read_mcap(std::string_view(whole).substr(0, size)));
  }
}

TEST_CASE("a file is there whole or not at all") {
  const test::Scratch scratch("mcap");
  const std::string path = scratch.path() / "run.mcap";
  {
    Writer writer(path, {"", "", 100, true});
    writer.add(Channel{0, "/a", "json", {}});
    for (std::uint32_t i = 0; i < 100; ++i) writer.write({1, i, i, i, "{}"});
  }
  REQUIRE(files_in(scratch.path()) == 0);

  REQUIRE_THROWS_AS(Writer((scratch.path() / "none" / "run.mcap").string()), io::DataError);
  REQUIRE_THROWS_AS(Writer("/dev/full"), io::DataError);
  Writer writer(path);
  REQUIRE_THROWS(writer.write({1, 0, 0, 0, "{}"}));
}

}  // namespace
}  // namespace understory::mcap
