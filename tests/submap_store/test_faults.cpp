// A file that cannot be written: one line, and the drive goes on; when it can, so does the store.
#include "tests/map_file/failing_disk.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

struct Faulty {
  TemporaryDirectory directory;
  std::filesystem::path file = directory.path() / "maps" / "drive-0001.gpkg";
  std::mt19937_64 random{8};

  model::Submap submap(model::SubmapId id) { return random_submap(1, id, random); }
  /// The mapper sends it again, a second later.
  static model::Submap again(model::Submap submap, model::Utime utime) {
    submap.utime = utime;
    return submap;
  }
  void check_refuses(StoreOnBus& store, const std::string& reason) {
    const model::Submap one = submap(500);
    store.send("SUBMAP", one);
    CHECK(store.stored.empty());
    CHECK(store.shown() == reason);
    store.send("SUBMAP_QUERY", query_for(1, {500}, 502'000'000));
    CHECK(store.replies.empty());
  }
  /// A drive's file with one submap.
  void make_file() {
    StoreOnBus store(directory.path());
    store.send("SUBMAP", submap(499));
    store.finish();
  }
};

}  // namespace

TEST_CASE_METHOD(Faulty, "a full disk stops the store only as long as it is full",
                 "[submap_store]") {
  for (const int code : {SQLITE_FULL, SQLITE_IOERR_WRITE, SQLITE_IOERR_READ}) {
    for (long first = 1; first < 60; first += 3) {
      CAPTURE(code, first);
      std::filesystem::remove_all(directory.path() / "maps");
      FailingDisk disk;
      std::vector<model::Submap> submaps;
      for (model::SubmapId id = 1; id <= 8; ++id) submaps.push_back(submap(id));
      {
        StoreOnBus store(directory.path());
        store.send("SUBMAP", submaps[0]);
        REQUIRE(store.stored.size() == 1);
        disk.fail_from(first, code);
        for (std::size_t i = 1; i < 4; ++i) store.send("SUBMAP", submaps[i]);
        if (store.stored.size() < 4)
          CHECK(store.shown() == (code == SQLITE_FULL ? "disk_full" : "file_unusable"));
        disk.set_whole();

        // Room again: what waits comes again, and is stored within five seconds.
        for (std::size_t i = 1; i < 4; ++i) store.send("SUBMAP", again(submaps[i], 6'000'000));
        store.send("SUBMAP", submaps[7]);
        CHECK(store.shown().empty());
        const auto confirmed = [&](model::SubmapId id) {
          return std::ranges::count(store.stored, id, &model::SubmapStored::id) > 0;
        };
        CHECK((confirmed(2) && confirmed(3) && confirmed(4) && confirmed(8)));
        store.finish();
      }
      const MapFile opened(file, Access::kRead);
      CHECK(opened.check().empty());
      CHECK(opened.read(1).landmarks.size() == 5 * 40);
    }
  }
}

TEST_CASE_METHOD(Faulty, "a file that another process has open", "[submap_store]") {
  make_file();
  StoreOnBus store(directory.path());
  {
    const MapFile other(file, Access::kWrite);
    check_refuses(store, "file_in_use");
  }
  // As soon as it is free the drive goes on in it.
  store.send("SUBMAP", again(submap(500), 504'000'000));
  CHECK(store.stored.size() == 1);
  CHECK(store.shown().empty());
  StoreOnBus second(directory.path());
  check_refuses(second, "file_in_use");
}

TEST_CASE_METHOD(Faulty, "files that are something else, damaged, or of another time",
                 "[submap_store]") {
  const auto next = file.parent_path() / "drive-0002.gpkg";
  const auto aside = file.parent_path() / "drive-0001.gpkg.set-aside";
  const auto passed_over = [&](const std::string& reason, bool is_set_aside) {
    const Bytes before = read_bytes(file);
    StoreOnBus store(directory.path());
    store.send("SUBMAP", submap(500));
    CHECK(store.stored.size() == 1);
    CHECK(store.shown() == reason);
    store.finish();
    CHECK(std::filesystem::exists(aside) == is_set_aside);
    CHECK(read_bytes(is_set_aside ? aside : file) == before);
    CHECK(MapFile(next, Access::kRead).check().empty());
    std::filesystem::remove_all(file.parent_path());
    make_file();
  };
  make_file();
  write_bytes(file, Bytes(5000, 'x'));
  passed_over("file_foreign", true);
  std::filesystem::remove(file);
  RawFile(file).run("CREATE TABLE t (x)");
  passed_over("file_foreign", true);
  RawFile(file).run("DROP TABLE understory_submaps");
  passed_over("file_damaged", true);
  RawFile(file).run("UPDATE understory_meta SET value = '9' WHERE key = 'schema_version'");
  passed_over("file_unusable", false);
}

TEST_CASE_METHOD(Faulty, "a turned bit in a submap is found, not given out", "[submap_store]") {
  for (const std::string column : {"payload", "landmarks", "keyframes", "border"}) {
    CAPTURE(column);
    std::filesystem::remove_all(file.parent_path());
    make_file();
    RawFile(file).run(fmt::format(
        "UPDATE understory_submaps SET {0} = substr({0}, 1, 10) || x'5a5b' || substr({0}, 13)",
        column));
    CHECK_FALSE(MapFile(file, Access::kRead).check().empty());
    StoreOnBus store(directory.path());
    store.send("SUBMAP_QUERY", query_for(1, {499}, 500'000'000));
    CHECK(store.replies.empty());
    CHECK(store.shown() == "file_damaged");
    store.finish();
    CHECK(std::filesystem::exists(file.string() + ".set-aside"));
  }
}

TEST_CASE_METHOD(Faulty, "a folder that cannot be written", "[submap_store]") {
  if (::geteuid() == 0) {
    // Root may write everywhere: the folder is a file.
    write_bytes(directory / "maps", Bytes(3, 'x'));
    StoreOnBus store(directory.path());
    store.send("SUBMAP", submap(500));
    CHECK(store.stored.empty());
    CHECK_FALSE(store.shown().empty());
    CHECK(read_bytes(directory / "maps") == Bytes(3, 'x'));
    std::filesystem::remove(directory / "maps");
    store.send("SUBMAP", again(submap(500), 504'000'000));
    CHECK(store.stored.size() == 1);
    return;
  }
  std::filesystem::permissions(directory.path(), std::filesystem::perms(0555));
  StoreOnBus store(directory.path());
  check_refuses(store, "file_read_only");
  std::filesystem::permissions(directory.path(), std::filesystem::perms(0755));
}

TEST_CASE_METHOD(Faulty, "a file of the schema before is taken over", "[submap_store]") {
  std::filesystem::create_directories(directory / "maps");
  StoredMap map = random_map(1, random);
  map.existence.reset();
  map_file::create_map_file(file, {&map, 1}, note("made"));
  make_older(file, 1);
  CHECK(MapFile(file, Access::kRead).check().empty());
  const Bytes before = read_bytes(file);
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
  CHECK(read_bytes(file) == before);

  // A store does not go on in a map that people made: its drive is the next file.
  StoreOnBus store(directory.path());
  store.send("SUBMAP", submap(3));
  CHECK(store.stored.size() == 1);
  store.finish();
  CHECK(std::filesystem::exists(directory.path() / "maps" / "drive-0002.gpkg"));
  CHECK(same(MapFile(file, Access::kRead).read(1), map));

  const StoredMap second = random_map(2, random);
  MapFile(file, Access::kWrite).put({&second, 1}, note("put"));
  const MapFile opened(file, Access::kRead);
  CHECK(opened.check().empty());
  CHECK(opened.history().size() == 2);
  CHECK(same(opened.read(1), map));
}
