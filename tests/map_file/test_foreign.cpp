// Files that are not opened: one line that names the file, and nothing is touched.
#include "common/map_file/schema.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Opened {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "some.gpkg";
  std::mt19937_64 random{12};
  StoredMap map = random_map(1, random);

  Opened() { map_file::create_map_file(file, {&map, 1}, note("made")); }

  void check_refused(Fault fault) const {
    const Bytes before = read_bytes(file);
    for (const Access access : {Access::kRead, Access::kWrite})
      CHECK(fault_of_opening(file, access) == fault);
    CHECK(read_bytes(file) == before);
    CHECK_FALSE(std::filesystem::exists(file.string() + "-wal"));
  }
};

}  // namespace

TEST_CASE_METHOD(Opened, "what is no map file is refused by name", "[map_file]") {
  for (const auto& path : {directory / "none.gpkg", directory.path()}) {
    for (const Access access : {Access::kRead, Access::kWrite})
      CHECK(fault_of_opening(path, access) == Fault::kUnreadable);
  }
  CHECK_FALSE(std::filesystem::exists(directory / "none.gpkg"));

  for (const std::string content : {"", "x", "x_m,y_m\n1,2\n", "SQLite format 3"}) {
    CAPTURE(content);
    write_bytes(file, Bytes(content.begin(), content.end()));
    check_refused(Fault::kForeign);
  }
  write_bytes(file, Bytes(100'000, 'x'));
  check_refused(Fault::kForeign);
}

TEST_CASE_METHOD(Opened, "databases of others are refused and left alone", "[map_file]") {
  std::filesystem::remove(file);
  RawFile(file).run("CREATE TABLE t (x); INSERT INTO t VALUES (1)");
  check_refused(Fault::kForeign);
  RawFile(file).run("PRAGMA application_id = 0x47504B47");
  check_refused(Fault::kForeign);
}

TEST_CASE_METHOD(Opened, "other versions of the schema are refused by number", "[map_file]") {
  RawFile(file).run("UPDATE understory_meta SET value = '5'");
  check_refused(Fault::kOtherVersion);
  CHECK_THROWS_WITH(MapFile(file, Access::kRead), Contains("'5'") && Contains("newer"));
  RawFile(file).run("UPDATE understory_meta SET value = '0'");
  check_refused(Fault::kOtherVersion);
  CHECK_THROWS_WITH(MapFile(file, Access::kRead), Contains("'0'") && !Contains("newer"));
  RawFile(file).run("DELETE FROM understory_meta");
  check_refused(Fault::kOtherVersion);
}

TEST_CASE_METHOD(Opened, "a table that is missing is named", "[map_file]") {
  RawFile(file).run("DROP TABLE trajectory");
  check_refused(Fault::kDamaged);
  CHECK_THROWS_WITH(MapFile(file, Access::kRead), Contains("trajectory"));
}

TEST_CASE_METHOD(Opened, "tables and columns of others are left alone", "[map_file]") {
  RawFile(file).run("CREATE TABLE layer_styles (id INTEGER PRIMARY KEY, style TEXT)");
  const StoredMap other = random_map(2, random);
  MapFile(file, Access::kWrite).put({&other, 1}, note("put"));
  CHECK(MapFile(file, Access::kRead).check().empty());

  RawFile(file).run("ALTER TABLE landmarks ADD COLUMN remark TEXT");
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
  MapFile(file, Access::kWrite).revert(1, note("back"));
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
  const auto findings = MapFile(file, Access::kRead).check();
  REQUIRE(findings.size() == 1);
  CHECK_THAT(findings[0], Contains("landmarks: its definition was changed"));
}

TEST_CASE_METHOD(Opened, "one process at a time writes, and nobody reads meanwhile", "[map_file]") {
  const auto in_use = static_cast<int>(Fault::kInUse);
  {
    const MapFile writing(file, Access::kWrite);
    CHECK(fault_elsewhere(file, Access::kWrite) == in_use);
    CHECK(fault_elsewhere(file, Access::kRead) == in_use);
    // Within the process the same, and a refused one takes no locks with it.
    CHECK(fault_of_opening(file, Access::kRead) == Fault::kInUse);
    CHECK(fault_of_opening(file, Access::kWrite) == Fault::kInUse);
    CHECK(fault_elsewhere(file, Access::kWrite) == in_use);
  }
  {
    const MapFile reading(file, Access::kRead);
    CHECK(fault_elsewhere(file, Access::kRead) == -2);
    CHECK(fault_elsewhere(file, Access::kWrite) == in_use);
    CHECK(same(reading.read(1), map));
  }
  CHECK(fault_elsewhere(file, Access::kWrite) == -2);
}

TEST_CASE_METHOD(Opened, "a file that may not be written is read, and not changed", "[map_file]") {
  const auto as_nobody = [&](Access access) {
    return in_child([&] {
      constexpr uid_t kNobody = 65534;
      if (::geteuid() == 0 && ::setuid(kNobody) != 0) return 254;
      try {
        return MapFile(file, access).maps().size() == 1 ? 100 : 101;
      } catch (const MapFileError& error) {
        return static_cast<int>(error.fault());
      }
    });
  };

  using std::filesystem::perms;
  std::filesystem::permissions(file, perms(0444));
  std::filesystem::permissions(directory.path(), perms(0555));
  CHECK(as_nobody(Access::kRead) == 100);
  CHECK(as_nobody(Access::kWrite) == static_cast<int>(Fault::kReadOnly));
  // The file may be written, but no log can be kept beside it.
  std::filesystem::permissions(file, perms(0666));
  CHECK(as_nobody(Access::kRead) == 100);
  CHECK(as_nobody(Access::kWrite) != 100);
  std::filesystem::permissions(directory.path(), perms(0700));
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
}

TEST_CASE_METHOD(Opened, "what a killed writer left on a disk that cannot be written is named",
                 "[map_file]") {
  // As the writer's death leaves them: the file, and the log with its last change.
  const TemporaryDirectory elsewhere;
  const std::filesystem::path copy = elsewhere / "copied.gpkg";
  const std::filesystem::path log = copy.string() + "-wal";
  {
    MapFile writing(file, Access::kWrite);
    writing.put({&map, 1}, note("put"));
    std::filesystem::copy_file(file, copy);
    std::filesystem::copy_file(file.string() + "-wal", log);
  }

  const auto said_to_nobody = [&] {
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    in_child([&] {
      constexpr uid_t kNobody = 65534;
      if (::geteuid() == 0 && ::setuid(kNobody) != 0) return 254;
      std::string said = "opened";
      try {
        MapFile(copy, Access::kRead).check();
      } catch (const MapFileError& error) {
        said = error.what();
      }
      return ::write(ends[1], said.data(), said.size()) > 0 ? 0 : 1;
    });
    ::close(ends[1]);
    std::string said(4096, ' ');
    said.resize(static_cast<std::size_t>(std::max<ssize_t>(::read(ends[0], said.data(), 4096), 0)));
    ::close(ends[0]);
    return said;
  };

  using std::filesystem::perms;
  std::filesystem::permissions(copy, perms(0444));
  std::filesystem::permissions(log, perms(0444));
  std::filesystem::permissions(elsewhere.path(), perms(0555));
  const std::string said = said_to_nobody();
  CHECK_THAT(said, Contains(copy.string()) && Contains("copied.gpkg-wal") &&
                       Contains("Permission denied") && Contains("copy both files"));

  // Nothing is wrong with them: where they can be written, all of it is there.
  std::filesystem::permissions(elsewhere.path(), perms(0700));
  std::filesystem::permissions(copy, perms(0600));
  std::filesystem::permissions(log, perms(0600));
  const MapFile brought_in(copy, Access::kRead);
  CHECK(brought_in.check().empty());
  CHECK(brought_in.history().size() == 2);
}
