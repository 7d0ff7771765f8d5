// What was recorded comes out of every container, in order of time.
#include <sqlite3.h>

#include <algorithm>
#include <random>

#include "common/bag/bag.hpp"
#include "common/bag/chunk_order.hpp"
#include "common/io/data_error.hpp"
#include "tests/bag/bag_writer.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

namespace understory::test {
namespace {

/// Random messages; times grow, with ties and steps back of up to 20 ms.
std::vector<Recorded> random_recording(std::mt19937_64& random, std::size_t messages) {
  std::vector<Recorded> list;
  std::int64_t now = 1'600'000'000'000'000'000;
  for (std::size_t i = 0; i < messages; ++i) {
    now += static_cast<std::int64_t>(random() % 3) * 5'000'000;
    const std::size_t topic = random() % 3;
    Recorded message{"/topic" + std::to_string(topic),
                     "std_msgs/Type" + std::to_string(topic),
                     now - static_cast<std::int64_t>(random() % 4) * 5'000'000,
                     {}};
    message.data.resize(random() % 300);
    for (auto& byte : message.data) byte = static_cast<std::uint8_t>(random() % 7);
    list.push_back(std::move(message));
  }
  return list;
}

std::vector<Recorded> in_order(std::vector<Recorded> messages) {
  std::ranges::stable_sort(messages, {}, &Recorded::time_ns);
  return messages;
}

std::vector<Recorded> read_all(bag::Bag& bag) {
  std::vector<Recorded> list;
  while (const auto message = bag.next()) {
    const bag::Topic& topic = bag.topics().at(message->topic);
    list.push_back({topic.name,
                    topic.type,
                    message->received_ns,
                    {message->data.begin(), message->data.end()}});
  }
  return list;
}

void check_same(const std::vector<Recorded>& found, const std::vector<Recorded>& wanted) {
  REQUIRE(found.size() == wanted.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    CAPTURE(i);
    REQUIRE(found[i].topic == wanted[i].topic);
    REQUIRE(found[i].type == wanted[i].type);
    REQUIRE(found[i].time_ns == wanted[i].time_ns);
    REQUIRE(found[i].data == wanted[i].data);
  }
}

TEST_CASE("bag: every container gives what was recorded, in order of time") {
  const Scratch scratch("bag-containers");
  std::mt19937_64 random(1);
  for (const BagForm& form : all_bag_forms()) {
    for (const std::size_t count : {0, 1, 400}) {
      CAPTURE(form.name(), count);
      const auto messages = random_recording(random, count);
      write_bag(scratch.path() / form.file(), form, messages);
      const auto bag = bag::open_bag(scratch.path() / form.file());
      check_same(read_all(*bag), in_order(messages));

      std::uint64_t stated = 0;
      for (const bag::Topic& topic : bag->topics()) stated += topic.messages.value();
      CHECK(stated == count);
      bag->rewind({});
      check_same(read_all(*bag), in_order(messages));
    }
  }
}

TEST_CASE("bag: some topics alone") {
  const Scratch scratch("bag-topics");
  std::mt19937_64 random(2);
  const auto messages = random_recording(random, 300);
  for (const BagForm& form : all_bag_forms()) {
    CAPTURE(form.name());
    write_bag(scratch.path() / form.file(), form, messages);
    const auto bag = bag::open_bag(scratch.path() / form.file());
    const auto topic = std::ranges::find(bag->topics(), "/topic1", &bag::Topic::name);
    bag->rewind({static_cast<std::size_t>(topic - bag->topics().begin())});
    auto wanted = in_order(messages);
    std::erase_if(wanted, [](const Recorded& message) { return message.topic != "/topic1"; });
    check_same(read_all(*bag), wanted);
  }
}

TEST_CASE("bag: the files of a folder are one recording") {
  const Scratch scratch("bag-folder");
  std::mt19937_64 random(3);
  for (const BagForm& form : all_bag_forms()) {
    CAPTURE(form.name());
    const auto messages = random_recording(random, 300);
    const auto folder = scratch.path() / "split";
    std::filesystem::create_directories(folder);
    set_file_bytes(folder / "metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
    for (std::size_t part = 0; part < 3; ++part) {
      const std::vector<Recorded> own(
          messages.begin() + static_cast<std::ptrdiff_t>(100 * part),
          messages.begin() + static_cast<std::ptrdiff_t>(100 * part + 100));
      write_bag(folder / ("run_" + std::to_string(part) + form.file().substr(3)), form, own);
    }

    const auto bag = bag::open_bag(folder);
    CHECK(bag->topics().size() == 3);
    check_same(read_all(*bag), in_order(messages));
    REQUIRE_FALSE(bag->remarks().empty());
    CHECK(bag->remarks().front().find("3 files") != std::string::npos);
    std::filesystem::remove_all(folder);
  }
}

TEST_CASE("bag: a topic in an encoding that is not read is listed") {
  const Scratch scratch("bag-other");
  for (const auto kind : {BagForm::Kind::kMcap, BagForm::Kind::kSqlite}) {
    const BagForm form{kind};
    write_bag(scratch.path() / form.file(), form, {{"/other", "std_msgs/String", 5, {'{', '}'}}});
    const auto bag = bag::open_bag(scratch.path() / form.file());
    REQUIRE(bag->topics().size() == 1);
    CHECK(bag->topics()[0].encoding == bag::Encoding::kOther);
    CHECK(bag->topics()[0].encoding_name == "json");
    CHECK(bag->topics()[0].type == "std_msgs/String");
  }
}

TEST_CASE("bag: an SQLite bag is read without a trace beside it") {
  const Scratch scratch("bag-trace");
  std::mt19937_64 random(4);
  const BagForm form{BagForm::Kind::kSqlite};
  const auto messages = random_recording(random, 50);
  write_bag(scratch.path() / "run.db3", form, messages);
  const std::string before = file_bytes(scratch.path() / "run.db3");
  const auto bag = bag::open_bag(scratch.path() / "run.db3");
  check_same(read_all(*bag), in_order(messages));
  CHECK(file_bytes(scratch.path() / "run.db3") == before);
  CHECK(std::distance(std::filesystem::directory_iterator(scratch.path()), {}) == 1);
}

TEST_CASE("bag: the write-ahead log of a recorder that died is read, too") {
  const Scratch scratch("bag-wal");
  std::mt19937_64 random(6);
  const auto messages = random_recording(random, 80);
  const std::vector<Recorded> first(messages.begin(), messages.begin() + 40);
  write_bag(scratch.path() / "live.db3", {BagForm::Kind::kSqlite}, first);
  sqlite3* file = nullptr;
  REQUIRE(sqlite3_open((scratch.path() / "live.db3").c_str(), &file) == SQLITE_OK);
  const auto run = [&](const std::string& sql) {
    REQUIRE(sqlite3_exec(file, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  };
  run("PRAGMA journal_mode = WAL");
  run("INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp + 1000, data "
      "FROM messages");
  // As the files were when it died.
  for (const char* ending : {"", "-wal"})
    std::filesystem::copy_file(scratch.path() / ("live.db3" + std::string(ending)),
                               scratch.path() / ("died.db3" + std::string(ending)));
  sqlite3_close(file);
  const auto bag = bag::open_bag(scratch.path() / "died.db3");
  CHECK(read_all(*bag).size() == 80);
}

TEST_CASE("bag: what is no bag is refused by name") {
  const Scratch scratch("bag-none");
  const auto refused = [&](const std::string& name, const std::string& bytes,
                           const std::string& what) {
    set_file_bytes(scratch.path() / name, bytes);
    CHECK_THROWS_WITH(bag::open_bag(scratch.path() / name),
                      Catch::Matchers::Contains(name) && Catch::Matchers::Contains(what));
  };
  refused("empty", "", "no bag");
  refused("text", "hello", "no bag");
  refused("old.bag", "#ROSBAG V1.2\n", "rosbag fix");
  refused("run.db3.zstd", "\x28\xB5\x2F\xFD....", "zstd -d");
  CHECK_THROWS_AS(bag::open_bag(scratch.path() / "not there"), io::DataError);
  std::filesystem::create_directories(scratch.path() / "folder");
  CHECK_THROWS_WITH(bag::open_bag(scratch.path() / "folder"),
                    Catch::Matchers::Contains("without .bag"));
  set_file_bytes(scratch.path() / "folder/run_0.db3.zstd", "x");
  CHECK_THROWS_WITH(bag::open_bag(scratch.path() / "folder"), Catch::Matchers::Contains("zstd -d"));
}

TEST_CASE("bag: chunks that overlap come in order, within the memory given") {
  std::mt19937_64 random(5);
  constexpr std::size_t kChunks = 40;
  constexpr std::size_t kEntries = 30;
  std::vector<bag::LoadedChunk> chunks(kChunks);
  std::vector<bag::ChunkSpan> spans(kChunks);
  for (std::size_t c = 0; c < kChunks; ++c) {
    chunks[c].bytes.resize(kEntries, static_cast<std::uint8_t>(c));
    for (std::uint32_t i = 0; i < kEntries; ++i) {
      const auto time = static_cast<std::int64_t>(10 * c + random() % 200);
      chunks[c].entries.push_back({time, static_cast<std::uint32_t>(c % 2), i, 1});
    }
    const auto [first, last] =
        std::ranges::minmax(chunks[c].entries, {}, &bag::ChunkEntry::time_ns);
    spans[c] = {first.time_ns, last.time_ns};
  }

  for (const std::size_t memory : {std::size_t{0}, 3 * kEntries, 1000 * kEntries}) {
    bag::ChunkOrder order(
        spans, [&](std::size_t chunk) { return chunks[chunk]; },
        [](std::uint32_t channel) { return channel == 1; }, memory);
    std::int64_t last = 0;
    std::size_t count = 0;
    while (const auto item = order.next()) {
      REQUIRE(item->entry.time_ns >= last);
      REQUIRE(item->data.size() == 1);
      REQUIRE(item->data[0] % 2 == 1);
      last = item->entry.time_ns;
      ++count;
    }
    CHECK(count == kChunks / 2 * kEntries);
    // Enough memory: each is unpacked once.
    if (memory == 1000 * kEntries) CHECK(order.loads() == kChunks);
    if (memory == 0) CHECK(order.loads() > kChunks);
  }
}

}  // namespace
}  // namespace understory::test
