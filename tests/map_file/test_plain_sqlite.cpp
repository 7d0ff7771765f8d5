// Maps that a person edits with an SQLite that has no functions for geometries.
#include <cstdlib>

#include "tests/map_file/map_fixture.hpp"
#include "tests/skip.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// As any program opens it; nothing is registered.
class PlainSqlite {
 public:
  explicit PlainSqlite(const std::filesystem::path& path) {
    REQUIRE(sqlite3_open(path.c_str(), &handle_) == SQLITE_OK);
  }
  ~PlainSqlite() { sqlite3_close(handle_); }
  PlainSqlite(const PlainSqlite&) = delete;
  PlainSqlite& operator=(const PlainSqlite&) = delete;

  /// Empty where it is done, else SQLite's message.
  std::string done(const std::string& sql) const {
    char* message = nullptr;
    sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, &message);
    const std::string text = message == nullptr ? "" : message;
    sqlite3_free(message);
    return text;
  }

 private:
  sqlite3* handle_ = nullptr;
};

struct Edited {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  std::mt19937_64 random{31};
  StoredMap map = random_map(3, random, 60);

  Edited() {
    while (map.landmarks.size() < 5 || map.keyframes.empty() || map.submap_borders.empty() ||
           map.loop_closures.empty())
      map = random_map(3, random, 60);
    map_file::create_map_file(file, {&map, 1}, note("made"));
  }

  /// What check says is that the map was changed, and nothing else.
  void check_noticed() const {
    const auto findings = MapFile(file, Access::kRead).check();
    REQUIRE(findings.size() == 1);
    CHECK_THAT(findings[0], Contains("map 3: is not what its checksum says") &&
                                Contains("map accept") && Contains("map revert"));
    CHECK(fault_of_work(file, [&] { MapFile(file, Access::kRead).read(3); }) == Fault::kDamaged);
  }
};

/// Columns of a layer that are neither its key nor its geometry.
std::vector<std::string> attributes_of(const std::filesystem::path& file,
                                       const map_file::Layer& layer) {
  const std::string rows = RawFile(file).rows(fmt::format(
      "SELECT name FROM pragma_table_info('{}') WHERE pk = 0 AND name != 'geom'", layer.table));
  std::vector<std::string> names;
  for (std::size_t at = 0; at < rows.size(); at = rows.find('\n', at) + 1)
    names.push_back(rows.substr(at, rows.find('|', at) - at));
  return names;
}

}  // namespace

TEST_CASE_METHOD(Edited, "every attribute of every layer can be changed without functions",
                 "[map_file]") {
  for (const map_file::Layer& layer : map_file::kLayers) {
    for (const std::string& column : attributes_of(file, layer)) {
      CAPTURE(layer.table, column);
      CHECK(PlainSqlite(file).done(
                fmt::format("UPDATE {} SET {} = {}", layer.table, column, column)) == "");
    }
  }
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(same(MapFile(file, Access::kRead).read(3), map));
}

TEST_CASE_METHOD(Edited, "an attribute that was changed is taken over, or taken back",
                 "[map_file]") {
  const model::LandmarkId id = map.landmarks[2].landmark.id;
  const std::string edit = fmt::format(
      "UPDATE landmarks SET diameter_m = 0.75, kind = 'corner' WHERE landmark_id = {}", id);
  REQUIRE(PlainSqlite(file).done(edit) == "");
  check_noticed();
  MapFile(file, Access::kWrite).revert(1, note("back"));
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(same(MapFile(file, Access::kRead).read(3), map));

  REQUIRE(PlainSqlite(file).done(edit) == "");
  MapFile(file, Access::kWrite).accept(note("by hand"));
  CHECK(MapFile(file, Access::kRead).check().empty());
  map.landmarks[2].landmark.radius_m = 0.375;
  map.landmarks[2].landmark.kind = model::LandmarkKind::kCorner;
  CHECK(same(MapFile(file, Access::kRead).read(3), map));
}

TEST_CASE_METHOD(Edited, "features are deleted without functions, and the index follows",
                 "[map_file]") {
  const std::string before = dump(file);
  for (const map_file::Layer& layer : map_file::kLayers)
    REQUIRE(PlainSqlite(file).done(fmt::format("DELETE FROM {0} WHERE {1} = (SELECT max({1}) FROM "
                                               "{0})",
                                               layer.table, layer.key)) == "");
  if (map.existence) map.existence.reset();
  const auto findings = MapFile(file, Access::kRead).check();
  for (const std::string& one : findings) CHECK_THAT(one, !Contains("index"));
  MapFile(file, Access::kWrite).accept(note("by hand"));
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(MapFile(file, Access::kRead).read(3).landmarks.size() == map.landmarks.size() - 1);
  MapFile(file, Access::kWrite).revert(1, note("back"));
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(dump(file) == before);
}

TEST_CASE_METHOD(Edited, "what moves a feature needs the functions, and changes nothing without",
                 "[map_file]") {
  const Bytes bytes = read_bytes(file);
  for (const char* const edit :
       {"UPDATE landmarks SET geom = geom", "UPDATE landmarks SET landmark_id = landmark_id + 1",
        "INSERT INTO landmarks SELECT landmark_id + 100000, geom, map_id, submap_id, NULL, NULL, "
        "NULL, NULL, kind, 1, NULL FROM landmarks"})
    CHECK_THAT(PlainSqlite(file).done(edit), Contains("no such function: ST_"));
  CHECK(read_bytes(file) == bytes);
  // With them a feature that gets another number is in the index under it.
  RawFile(file).run(
      fmt::format("UPDATE landmarks SET landmark_id = landmark_id + 1 WHERE "
                  "landmark_id = {}",
                  map.landmarks.back().landmark.id));
  for (const std::string& one : MapFile(file, Access::kRead).check())
    CHECK_THAT(one, !Contains("index"));
}

TEST_CASE_METHOD(Edited, "a file of version 3 can be edited once it has been written",
                 "[map_file]") {
  make_older(file, 3);
  const std::string edit = "UPDATE landmarks SET kind = 'corner' WHERE kind = 'trunk'";
  CHECK_THAT(PlainSqlite(file).done(edit), Contains("no such function: ST_IsEmpty"));
  CHECK(MapFile(file, Access::kRead).check().empty());
  { const MapFile opened(file, Access::kWrite); }
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(same(MapFile(file, Access::kRead).read(3), map));
  CHECK(PlainSqlite(file).done(edit) == "");
  check_noticed();
}

TEST_CASE_METHOD(Edited, "triggers as the standard has them are ours as well", "[map_file]") {
  for (const map_file::SchemaObject& one : map_file::schema_objects(3)) {
    if (one.sql.starts_with("CREATE TRIGGER"))
      RawFile(file).run(fmt::format("DROP TRIGGER {}; {}", one.name, one.sql));
  }
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(MapFile(file, Access::kWrite).put({&map, 1}, note("again")) == 2);
  CHECK(MapFile(file, Access::kRead).check().empty());
}

TEST_CASE_METHOD(Edited, "the sqlite3 shell edits a map", "[map_file]") {
  if (std::system("command -v sqlite3 > /dev/null") != 0)  // NOLINT(cert-env33-c)
    skip("the shell sqlite3 is not installed");
  const std::string line = fmt::format(
      "sqlite3 -bail {} \"UPDATE landmarks SET kind = 'corner'; DELETE FROM trajectory WHERE fid = "
      "(SELECT min(fid) FROM trajectory)\"",
      file.string());
  CHECK(std::system(line.c_str()) == 0);  // NOLINT(cert-env33-c)
  check_noticed();
  MapFile(file, Access::kWrite).accept(note("by hand"));
  const StoredMap edited = MapFile(file, Access::kRead).read(3);
  CHECK(edited.keyframes.size() == map.keyframes.size() - 1);
  for (const map_file::StoredLandmark& one : edited.landmarks)
    CHECK(one.landmark.kind == model::LandmarkKind::kCorner);
}
