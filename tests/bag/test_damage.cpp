// Damaged bags give an error that names the file, or what is before the damage.
#include <sqlite3.h>

#include <algorithm>
#include <limits>
#include <random>

#include "common/bag/bag.hpp"
#include "common/bag/survey.hpp"
#include "common/io/data_error.hpp"
#include "tests/bag/bag_writer.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

namespace understory::test {
namespace {

using Random = std::mt19937_64;
constexpr std::int64_t kStart = 1'600'000'000'000'000'000;

/// Messages of every kind that is read, in order of time.
std::vector<Recorded> drive(Random& random, bag::Encoding encoding) {
  const Serialisation how{encoding, false};
  std::vector<Recorded> list;
  const std::vector mounts(1, frame_in("base_link", "laser", Eigen::Isometry3d::Identity()));
  list.push_back({"/tf_static", "tf2_msgs/TFMessage", kStart, transforms_message(how, mounts)});
  std::vector<std::uint8_t> points(40 * 18);
  for (auto& byte : points) byte = static_cast<std::uint8_t>(random() % 80);
  for (std::int64_t i = 1; i <= 40; ++i) {
    const std::int64_t now = kStart + i * 10'000'000;
    list.push_back({"/imu", "sensor_msgs/Imu", now,
                    imu_message(how, {{now, "imu"}, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.8}})});
    if (i % 4 != 0) continue;
    bag::PointCloud cloud;
    cloud.header = {now, "laser"};
    cloud.height = 1;
    cloud.width = 40;
    cloud.fields = {
        {"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}, {"t", 12, 6, 1}, {"ring", 16, 4, 1}};
    cloud.point_step = 18;
    cloud.row_step = 720;
    for (std::size_t p = 0; p < 40; ++p) {
      points[18 * p + 16] = static_cast<std::uint8_t>(p % 16);
      points[18 * p + 17] = 0;
      points[18 * p + 15] = 0;
    }
    cloud.data = points;
    list.push_back({"/points", "sensor_msgs/PointCloud2", now + 1, cloud_message(how, cloud)});
  }
  return list;
}

/// As an import does; what is wrong with a message is an error, too.
void decode(const bag::Bag& bag, const bag::Message& message, bag::CloudDecoder& decoder) {
  const std::string& type = bag.topics()[message.topic].type;
  try {
    bag::MessageReader reader = reader_of(bag, message);
    if (type == "sensor_msgs/Imu") read_imu(reader);
    if (type == "sensor_msgs/PointCloud2") decoder.decode(read_point_cloud(reader));
    if (type == "tf2_msgs/TFMessage") read_transforms(reader);
  } catch (const io::DataError&) {
    // Its text is looked at in tests/cli.
  }
}

/// Reads all of it as an import does. An error must name the file.
std::vector<Recorded> read_damaged(const std::filesystem::path& path, std::size_t& errors) {
  std::vector<Recorded> list;
  try {
    const auto bag = bag::open_bag(path);
    survey(*bag, {});
    bag::CloudDecoder decoder;
    while (const auto message = bag->next()) {
      const bag::Topic& topic = bag->topics().at(message->topic);
      list.push_back({topic.name,
                      topic.type,
                      message->received_ns,
                      {message->data.begin(), message->data.end()}});
      decode(*bag, *message, decoder);
    }
  } catch (const io::DataError& error) {
    CHECK_THAT(error.what(), Catch::Matchers::Contains(path.filename().string()));
    ++errors;
  }
  return list;
}

bool is_one_of(const Recorded& message, const std::vector<Recorded>& wanted) {
  return std::ranges::any_of(wanted, [&](const Recorded& other) {
    return other.topic == message.topic && other.time_ns == message.time_ns &&
           other.data == message.data;
  });
}

TEST_CASE("bag damage: a bag that is cut off gives what is before the cut") {
  const Scratch scratch("bag-cut");
  Random random(1);
  for (const BagForm& form : all_bag_forms()) {
    const auto messages = drive(random, form.encoding());
    const auto path = scratch.path() / form.file();
    write_bag(path, form, messages);
    const std::string whole = file_bytes(path);
    std::size_t errors = 0;
    std::size_t most = 0;

    for (int round = 0; round < 200; ++round) {
      const std::size_t size = random() % whole.size();
      CAPTURE(form.name(), size, whole.size());
      set_file_bytes(path, whole.substr(0, size));
      const auto found = read_damaged(path, errors);
      REQUIRE(found.size() <= messages.size());
      most = std::max(most, found.size());
      // SQLite keeps no order in the file: what it gives is real, but no prefix.
      for (std::size_t i = 0; i < found.size(); ++i)
        REQUIRE((form.kind == BagForm::Kind::kSqlite ? is_one_of(found[i], messages)
                                                     : found[i].data == messages[i].data));
    }
    CAPTURE(form.name(), errors, most);
    if (form.kind != BagForm::Kind::kSqlite) CHECK(most > messages.size() / 2);
  }
}

TEST_CASE("bag damage: what a recorder wrote before it died is all read") {
  const Scratch scratch("bag-died");
  Random random(2);
  for (const BagForm& form : all_bag_forms()) {
    if (form.kind == BagForm::Kind::kSqlite) continue;
    CAPTURE(form.name());
    const auto messages = drive(random, form.encoding());
    const auto path = scratch.path() / form.file();
    write_bag(path, form, messages);
    const std::string whole = file_bytes(path);
    // A byte is missing at the end: index, summary or footer are not whole, the messages are.
    set_file_bytes(path, whole.substr(0, whole.size() - 1));
    const auto bag = bag::open_bag(path);
    std::size_t count = 0;
    while (bag->next()) ++count;
    CHECK(count == messages.size());
    // And zeros that a file system leaves at the end.
    set_file_bytes(path, whole.substr(0, whole.size() - 40) + std::string(5000, '\0'));
    const auto with_zeros = bag::open_bag(path);
    count = 0;
    while (with_zeros->next()) ++count;
    CHECK(count == messages.size());
    CHECK_FALSE(with_zeros->remarks().empty());
  }
}

TEST_CASE("bag damage: changed bytes give an error or messages, never a crash") {
  const Scratch scratch("bag-flips");
  Random random(3);
  for (const BagForm& form : all_bag_forms()) {
    const auto messages = drive(random, form.encoding());
    const auto path = scratch.path() / form.file();
    write_bag(path, form, messages);
    const std::string whole = file_bytes(path);
    std::size_t errors = 0;
    for (int round = 0; round < 200; ++round) {
      std::string damaged = whole;
      for (std::size_t i = 0; i <= random() % 6; ++i)
        damaged[random() % damaged.size()] = static_cast<char>(random());
      if (random() % 4 == 0) damaged.erase(random() % damaged.size(), random() % 50);
      CAPTURE(form.name(), round);
      set_file_bytes(path, damaged);
      read_damaged(path, errors);
    }
    // MCAP has checksums: most changes inside of chunks are noticed.
    CAPTURE(form.name(), errors);
    if (form.kind == BagForm::Kind::kMcap && form.has_chunks) CHECK(errors > 60);
  }
}

/// An SQLite file that these statements make.
class MadeDatabase {
 public:
  explicit MadeDatabase(const std::filesystem::path& path) {
    REQUIRE(sqlite3_open(path.c_str(), &file_) == SQLITE_OK);
  }
  ~MadeDatabase() { sqlite3_close(file_); }
  MadeDatabase(const MadeDatabase&) = delete;
  MadeDatabase& operator=(const MadeDatabase&) = delete;
  void run(const std::string& sql) {
    REQUIRE(sqlite3_exec(file_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  }

 private:
  sqlite3* file_ = nullptr;
};

TEST_CASE("bag damage: an SQLite bag that cannot be read says why, and what helps") {
  const Scratch scratch("bag-sqlite");
  const auto path = scratch.path() / "run.db3";
  Random random(6);
  write_bag(path, {BagForm::Kind::kSqlite}, drive(random, bag::Encoding::kCdr));
  const std::string whole = file_bytes(path);
  const auto refused = [&](const std::string& what) {
    CHECK_THROWS_WITH(bag::open_bag(path), Catch::Matchers::StartsWith(path.string() + ": ") &&
                                               Catch::Matchers::Contains(what));
  };

  constexpr std::size_t kPage = 4096;
  std::string page_lost = whole;
  page_lost.replace(kPage, kPage, kPage, '\x5A');
  set_file_bytes(path, page_lost);
  refused("damaged (database disk image is malformed): 'sqlite3 " + path.string() + " .recover");

  std::string header_lost = whole;
  header_lost[21] = 0;
  set_file_bytes(path, header_lost);
  refused("damaged or encrypted");

  for (const std::string column : {"serialization_format", "topic_id", "timestamp", "data"}) {
    set_file_bytes(path, whole);
    MadeDatabase file(path);
    file.run("DROP INDEX IF EXISTS timestamp_idx");
    file.run("ALTER TABLE " +
             std::string(column == "serialization_format" ? "topics" : "messages") +
             " RENAME COLUMN " + column + " TO other");
    refused("has no column " + column);
  }
}

TEST_CASE("bag damage: an SQLite bag that a recorder has open, or whose log cannot be read") {
  const Scratch scratch("bag-open");
  const auto path = scratch.path() / "run.db3";
  Random random(7);
  write_bag(path, {BagForm::Kind::kSqlite}, drive(random, bag::Encoding::kCdr));
  {
    MadeDatabase recorder(path);
    recorder.run("PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = WAL");
    recorder.run("DELETE FROM messages WHERE id = 1");
    CHECK_THROWS_WITH(bag::open_bag(path), Catch::Matchers::Contains("run.db3: a recorder still"));
    std::filesystem::copy_file(path, scratch.path() / "died.db3");
    std::filesystem::copy_file(path.string() + "-wal", scratch.path() / "died.db3-wal");
  }
  // SQLite makes this file beside a log, which it cannot do in a folder that is read only.
  std::filesystem::create_symlink("nowhere/shm", scratch.path() / "died.db3-shm");
  CHECK_THROWS_WITH(bag::open_bag(scratch.path() / "died.db3"),
                    Catch::Matchers::Contains("died.db3: cannot be opened") &&
                        Catch::Matchers::Contains("its folder must be writable"));
}

TEST_CASE("bag damage: times that no clock has") {
  const Scratch scratch("bag-times");
  Random random(5);
  for (const auto kind : {BagForm::Kind::kMcap, BagForm::Kind::kSqlite}) {
    const BagForm form{kind};
    auto messages = drive(random, form.encoding());
    messages[3].time_ns = std::numeric_limits<std::int64_t>::min();
    messages[9].time_ns = std::numeric_limits<std::int64_t>::max();
    messages[10].time_ns = -1;
    write_bag(scratch.path() / form.file(), form, messages);
    std::size_t errors = 0;
    CHECK(read_damaged(scratch.path() / form.file(), errors).size() == messages.size());
    CHECK(errors == 0);
  }
}

TEST_CASE("bag damage: random bytes behind the magic") {
  const Scratch scratch("bag-random");
  Random random(4);
  std::size_t errors = 0;
  const std::string magics[] = {"#ROSBAG V2.0\n", std::string("\x89MCAP0\r\n", 8),
                                std::string("SQLite format 3\0", 16)};
  for (const std::string& magic : magics) {
    for (int round = 0; round < 200; ++round) {
      std::string bytes = magic;
      const std::size_t size = random() % 500;
      for (std::size_t i = 0; i < size; ++i)
        bytes += static_cast<char>(random() % 4 == 0 ? random() % 16 : 0);
      set_file_bytes(scratch.path() / "random", bytes);
      read_damaged(scratch.path() / "random", errors);
    }
  }
  CHECK(errors > 0);
}

}  // namespace
}  // namespace understory::test
