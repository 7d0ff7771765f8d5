// A last file that is damaged in any way, before a drive and in it: the drive goes on in the next
// one, and nothing is deleted.
#include <fstream>
#include <functional>

#include "common/map_file/drive_file.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

/// What happened to a file.
struct Damage {
  std::string name;
  std::function<void(const fs::path&, std::mt19937_64&)> apply;
  bool is_noticed_at_start = true;
  bool is_set_aside = true;
};

void overwrite(const fs::path& file, std::size_t at, const Bytes& bytes) {
  // In place: the file stays the same one for whoever has it open.
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(at));
  stream.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
}

Bytes noise(std::size_t size, std::mt19937_64& random) {
  Bytes bytes(size);
  for (std::uint8_t& one : bytes) one = static_cast<std::uint8_t>(random());
  return bytes;
}

void flip(const fs::path& file, std::mt19937_64& random) {
  const auto size = fs::file_size(file);
  for (std::size_t count = 1 + random() % 50; count > 0; --count)
    overwrite(file, random() % size, noise(1, random));
}

std::vector<Damage> damages() {
  return {
      {"cut",
       [](const fs::path& file, std::mt19937_64& random) {
         fs::resize_file(file, 1 + random() % (fs::file_size(file) - 1));
       }},
      {"empty", [](const fs::path& file, std::mt19937_64&) { fs::resize_file(file, 0); }},
      {"flipped", flip, false},
      {"head", [](const fs::path& file,
                  std::mt19937_64& random) { overwrite(file, 0, noise(100, random)); }},
      {"folder",
       [](const fs::path& file, std::mt19937_64&) {
         fs::remove(file);
         fs::create_directories(file / "inside");
       },
       true, false},
      {"dangling link",
       [](const fs::path& file, std::mt19937_64&) {
         fs::remove(file);
         fs::create_symlink("nowhere.gpkg", file);
       },
       true, false},
      {"text",
       [](const fs::path& file, std::mt19937_64& random) {
         fs::remove(file);
         write_bytes(file, noise(5000, random));
       }},
      {"other database",
       [](const fs::path& file, std::mt19937_64&) {
         fs::remove(file);
         RawFile(file).run("CREATE TABLE t (x)");
       }},
      {"newer version",
       [](const fs::path& file, std::mt19937_64&) {
         RawFile(file).run("UPDATE understory_meta SET value = '9' WHERE key = 'schema_version'");
       },
       true, false},
      {"foreign trigger",
       [](const fs::path& file, std::mt19937_64&) {
         RawFile(file).run("CREATE TRIGGER odd AFTER INSERT ON landmarks BEGIN SELECT 1; END");
       },
       true, false},
  };
}

struct DamagedDrive {
  TemporaryDirectory directory;
  fs::path folder = directory.path() / "maps";
  fs::path first = folder / "drive-0001.gpkg";
  std::mt19937_64 random{77};
  std::vector<model::Submap> confirmed;

  void begin() {
    fs::remove_all(folder);
    confirmed.clear();
  }
  /// Sends it, again after two seconds where it was not confirmed as the mapper does.
  void send(StoreOnBus& store, model::SubmapId id) {
    model::Submap submap = random_submap(1, id, random, 30);
    for (int tries = 0; tries < 3; ++tries) {
      const std::size_t before = store.stored.size();
      store.send("SUBMAP", submap);
      if (store.stored.size() > before) return confirmed.push_back(submap);
      submap.utime += 2'000'000;
    }
    FAIL_CHECK("submap " << id << " was not stored");
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(folder)) all.push_back(entry.path());
    return all;
  }
  bool is_kept(const model::Submap& submap) const {
    for (const fs::path& file : files()) {
      try {
        const auto found = map_file::submap_in(file, {submap.map_id, submap.id});
        if (found && found->payload == submap.payload) return true;
      } catch (const MapFileError&) {
      }
    }
    return false;
  }
  std::size_t lost() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        confirmed, [this](const model::Submap& one) { return !is_kept(one); }));
  }
  bool has_bytes(const Bytes& bytes) const {
    return std::ranges::any_of(files(), [&](const fs::path& file) {
      return fs::is_regular_file(file) && read_bytes(file) == bytes;
    });
  }
  void check_clean(int number) const {
    try {
      const MapFile opened(folder / fmt::format("drive-{:04}.gpkg", number), Access::kRead);
      CHECK(opened.check().empty());
    } catch (const MapFileError& error) {
      FAIL_CHECK(error.what());
    }
  }
  void drive(model::SubmapId from, model::SubmapId to) {
    StoreOnBus store(directory.path());
    for (model::SubmapId id = from; id <= to; ++id) send(store, id);
    store.finish();
  }
};

}  // namespace

TEST_CASE_METHOD(DamagedDrive, "a damaged last file does not keep a drive from being stored",
                 "[submap_store]") {
  for (const Damage& damage : damages()) {
    for (int trial = 0; trial < 12; ++trial) {
      CAPTURE(damage.name, trial);
      begin();
      drive(1, 3);
      damage.apply(first, random);
      const bool is_file = fs::is_regular_file(first);
      const Bytes damaged = is_file ? read_bytes(first) : Bytes();
      confirmed.clear();

      StoreOnBus store(directory.path());
      for (model::SubmapId id = 4; id <= 6; ++id) send(store, id);
      const bool has_next = fs::exists(folder / "drive-0002.gpkg");
      if (damage.is_noticed_at_start) CHECK(has_next);
      CHECK(store.shown().empty() != has_next);
      store.finish();
      CHECK(lost() == 0);

      const bool is_aside = fs::exists(first.string() + ".set-aside");
      if (damage.is_noticed_at_start) CHECK(is_aside == damage.is_set_aside);
      if (is_file && has_next && damage.is_noticed_at_start) CHECK(has_bytes(damaged));
      if (!is_file) CHECK(fs::exists(fs::symlink_status(first)));
      if (damage.is_noticed_at_start) check_clean(2);

      // The next start has nothing to pass over, and goes on in the file that is good.
      drive(7, 8);
      CHECK(lost() == 0);
      CHECK(fs::exists(folder / "drive-0003.gpkg") == false);
    }
  }
}

TEST_CASE_METHOD(DamagedDrive, "a file that becomes damaged in a drive ends with the next file",
                 "[submap_store]") {
  std::size_t went_on = 0;
  std::size_t lost_by_flips = 0;
  for (const Damage& damage : damages()) {
    const bool is_by_others = damage.name == "newer version" || damage.name == "foreign trigger";
    if (is_by_others) continue;  // Nobody else can write it meanwhile.
    for (int trial = 0; trial < 12; ++trial) {
      CAPTURE(damage.name, trial);
      begin();
      StoreOnBus store(directory.path());
      for (model::SubmapId id = 1; id <= 1 + random() % 5; ++id) send(store, id);
      confirmed.clear();
      damage.apply(first, random);
      for (model::SubmapId id = 11; id <= 15; ++id) send(store, id);
      store.send("SUBMAP_QUERY", query_for(1, {1, 11, 15}, 20'000'000));
      CHECK(store.replies.size() >= 2);
      store.finish();

      const bool has_next = fs::exists(folder / "drive-0002.gpkg");
      went_on += has_next ? 1 : 0;
      if (damage.name == "flipped" || damage.name == "head") {
        lost_by_flips += lost();
        continue;
      }
      CHECK(has_next);
      CHECK(lost() == 0);
      check_clean(2);
    }
  }
  WARN(
      fmt::format("{} drives of 96 went on in the next file; {} submaps lost by bytes that were "
                  "turned under an open file",
                  went_on, lost_by_flips));
}

TEST_CASE_METHOD(DamagedDrive, "what a file still has comes back after it was passed over",
                 "[submap_store]") {
  StoreOnBus store(directory.path());
  for (model::SubmapId id = 1; id <= 4; ++id) send(store, id);
  fs::rename(first, directory / "elsewhere.gpkg");
  fs::create_directory(first);
  send(store, 5);
  fs::remove(first);
  fs::rename(directory / "elsewhere.gpkg", first);
  store.send("SUBMAP_QUERY", query_for(1, {2, 5}, 9'000'000));
  REQUIRE(store.replies.size() == 2);
  check_same(confirmed[1], store.replies[0]);
  check_same(confirmed[4], store.replies[1]);
  CHECK(store.shown() == "file_unusable");
  // A minute later all is well.
  send(store, 80);
  CHECK(store.shown().empty());
  store.finish();
  CHECK(lost() == 0);
  check_clean(1);
  check_clean(2);
}

TEST_CASE_METHOD(DamagedDrive, "the ground of a drive is written whole into its next file",
                 "[submap_store]") {
  StoreOnBus store(directory.path());
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  update.keyframe_sequence = 1;
  update.utime = 1'000'000;
  update.map_id = 1;
  update.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  store.send("SLAM_UPDATE", update);
  send(store, 2);
  CHECK(store.map_requests == 0);
  fs::resize_file(first, 0);
  send(store, 3);
  update.status = model::MapUpdateStatus::kUpdated;
  update.keyframe_sequence = 2;
  update.utime = 9'000'000;
  store.send("SLAM_UPDATE", update);
  update.keyframe_sequence = 3;
  update.utime = 11'000'000;
  store.send("SLAM_UPDATE", update);
  CHECK(store.map_requests > 0);
}

TEST_CASE_METHOD(DamagedDrive, "numbers of files that were set aside are not given again",
                 "[submap_store]") {
  for (int number = 1; number <= 4; ++number) {
    const fs::path file = folder / fmt::format("drive-{:04}.gpkg", number);
    drive(static_cast<model::SubmapId>(number), static_cast<model::SubmapId>(number));
    CHECK(fs::exists(file));
    fs::resize_file(file, 0);
  }
  for (int number = 1; number <= 3; ++number)
    CHECK(fs::exists(folder / fmt::format("drive-{:04}.gpkg.set-aside", number)));
}

TEST_CASE_METHOD(DamagedDrive, "a file that may not be written is left for the next one",
                 "[submap_store]") {
  drive(1, 2);
  fs::permissions(directory.path(), fs::perms(0777));
  fs::permissions(folder, fs::perms(0777));
  fs::permissions(first, fs::perms(0444));
  const Bytes before = read_bytes(first);
  const int stored = in_child([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::setuid(kNobody) != 0) return 254;
    StoreOnBus store(directory.path());
    send(store, 3);
    store.finish();
    return static_cast<int>(store.stored.size());
  });
  CHECK(stored == 1);
  CHECK(read_bytes(first) == before);
  check_clean(1);
  check_clean(2);
}
