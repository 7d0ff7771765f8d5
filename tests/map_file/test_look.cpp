// Files that a killed writer left are looked at, and not touched.
#include <sys/stat.h>

#include <map>

#include "common/map_file/drive_file.hpp"
#include "common/map_file/map_look.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
using map_file::MapLook;

namespace {

/// Names, bytes and times of change of a folder.
using FolderState = std::map<std::string, std::pair<Bytes, std::int64_t>>;

struct LeftBehind {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  std::mt19937_64 random{81};
  StoredMap before = random_map(1, random, 400);
  StoredMap after = random_map(1, random, 400);

  LeftBehind() {
    // More than the cache of a writer holds.
    while (before.landmarks.size() < 1000) before = random_map(1, random, 3000);
    map_file::create_map_file(file, {&before, 1}, note("made"));
  }

  FolderState state() const {
    FolderState state;
    for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
      struct ::stat found {};
      REQUIRE(::stat(entry.path().c_str(), &found) == 0);
      state[entry.path().filename()] = {
          read_bytes(entry.path()), found.st_mtim.tv_sec * 1'000'000'000 + found.st_mtim.tv_nsec};
    }
    return state;
  }
  /// A writer of our own, killed behind a change: the change is in the log.
  void kill_own_writer() const {
    in_child([&] {
      MapFile writing(file, Access::kWrite);
      writing.put({&after, 1}, note("put"));
      ::_exit(0);
      return 0;
    });
    REQUIRE(std::filesystem::exists(file.string() + "-wal"));
  }
  /// Another program, killed within a change: the journal has what was there.
  void kill_other_writer() const {
    const Bytes whole = read_bytes(file);
    in_child([&] {
      sqlite3* handle = nullptr;
      sqlite3_open(file.c_str(), &handle);
      sqlite3_exec(handle,
                   "PRAGMA cache_size = 5; PRAGMA cache_spill = 5; BEGIN; "
                   "UPDATE landmarks SET times_seen = 5; UPDATE landmarks SET existence = 0.5",
                   nullptr, nullptr, nullptr);
      ::_exit(0);
      return 0;
    });
    REQUIRE(std::filesystem::exists(file.string() + "-journal"));
    REQUIRE((read_bytes(file) != whole));
  }
  void check_looks_like(const StoredMap& wanted, const std::string& remark) const {
    const FolderState untouched = state();
    {
      const MapLook look(file);
      CHECK(same(look.file().read(1), wanted));
      CHECK(look.file().check().empty());
      CHECK_THAT(look.remark(), Contains(remark));
      CHECK(look.remark().empty() == remark.empty());
    }
    CHECK(state() == untouched);
  }
};

}  // namespace

TEST_CASE_METHOD(LeftBehind, "a file at rest is looked at as it is", "[map_file]") {
  check_looks_like(before, "");
  CHECK_THROWS_WITH(MapLook(directory / "none.gpkg"), Contains("there is no such file"));
  write_bytes(directory / "text.gpkg", Bytes(3000, 'x'));
  CHECK_THROWS_WITH(MapLook(directory / "text.gpkg"), Contains("text.gpkg: no map file"));
  write_bytes(directory / "empty.gpkg", {});
  CHECK_THROWS_WITH(MapLook(directory / "empty.gpkg"), Contains("it is empty"));
}

TEST_CASE_METHOD(LeftBehind, "a change in a log that was left is shown, and stays in it",
                 "[map_file]") {
  kill_own_writer();
  check_looks_like(after, "maps.gpkg-wal lies beside it");
  CHECK(same(MapFile(file, Access::kRead).read(1), after));
}

TEST_CASE_METHOD(LeftBehind, "a half change in a journal that was left is not shown",
                 "[map_file]") {
  kill_other_writer();
  check_looks_like(before, "maps.gpkg-journal lies beside it");
  CHECK(same(MapFile(file, Access::kRead).read(1), before));
}

TEST_CASE_METHOD(LeftBehind, "a drive whose store was killed is shown to its end, and stays open",
                 "[map_file]") {
  std::filesystem::remove(file);
  map_file::DriveFile::make(file);
  {
    map_file::DriveFile drive(file, true);
    map_file::GroundChange change;
    change.map_id = 1;
    change.utime = 7;
    change.landmarks = {random_landmark(map_file::landmark_id(1, 1), random).landmark};
    drive.put(change);
  }
  const FolderState untouched = state();
  {
    const MapLook look(file);
    CHECK(look.file().maps().front().trunks + look.file().maps().front().corners == 1);
    CHECK(look.file().history().size() == 1);
    CHECK_THAT(look.remark(), Contains("the store of its drive did not end"));
  }
  CHECK(state() == untouched);
}

TEST_CASE_METHOD(LeftBehind, "a file that is being written is in use", "[map_file]") {
  int ready[2];
  int done[2];
  REQUIRE(::pipe(ready) == 0);
  REQUIRE(::pipe(done) == 0);
  const pid_t writer = ::fork();
  if (writer == 0) {
    char byte = 0;
    MapFile writing(file, Access::kWrite);
    writing.put({&after, 1}, note("put"));
    const bool is_told = ::write(ready[1], &byte, 1) == 1 && ::read(done[0], &byte, 1) == 1;
    ::_exit(is_told ? 0 : 1);
  }
  char byte = 0;
  REQUIRE(::read(ready[0], &byte, 1) == 1);
  CHECK(fault_of_work(file, [&] { const MapLook look(file); }) == Fault::kInUse);
  REQUIRE(::write(done[1], &byte, 1) == 1);
  int status = 0;
  REQUIRE(::waitpid(writer, &status, 0) == writer);
}

TEST_CASE_METHOD(LeftBehind, "who may not write in the folder sees it, and is told what lies there",
                 "[map_file]") {
  using std::filesystem::perms;
  for (const bool is_own : {true, false}) {
    std::filesystem::remove(file);
    map_file::create_map_file(file, {&before, 1}, note("made"));
    is_own ? kill_own_writer() : kill_other_writer();
    const std::string left = is_own ? "maps.gpkg-wal" : "maps.gpkg-journal";
    CAPTURE(left);
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
      std::filesystem::permissions(entry.path(), perms(0444));
    std::filesystem::permissions(directory.path(), perms(0555));
    const int status = in_child([&] {
      constexpr uid_t kNobody = 65534;
      if (::geteuid() == 0 && ::setuid(kNobody) != 0) return 254;
      if (MapLook(file).file().maps().size() != 1) return 1;
      for (const Access access : {Access::kRead, Access::kWrite}) {
        try {
          const MapFile opened(file, access);
          return 2;
        } catch (const MapFileError& error) {
          const std::string line = error.what();
          if (line.find(left + " beside it") == std::string::npos) return 3;
          if (line.find("copy both files") == std::string::npos) return 4;
        }
      }
      return 0;
    });
    std::filesystem::permissions(directory.path(), perms(0755));
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
      std::filesystem::permissions(entry.path(), perms(0644));
    CHECK(status == 0);
    // Brought in where it can be.
    CHECK(same(MapFile(file, Access::kRead).read(1), is_own ? after : before));
  }
}
