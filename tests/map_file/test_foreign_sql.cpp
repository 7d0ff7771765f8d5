// SQL that somebody else left in a map file: refused where it would act, by name, before anything
// is written. All of it is harmless.
#include "common/map_file/schema.hpp"
#include "common/map_file/sql_text.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct ForeignSql {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "map.gpkg";
  std::mt19937_64 random{21};
  StoredMap map = random_map(1, random);
  StoredMap other = random_map(2, random);
  Bytes clean;

  ForeignSql() {
    map_file::create_map_file(file, {&map, 1}, note("made"));
    clean = read_bytes(file);
  }

  template <class T>
  const T& one_of(const std::vector<T>& all) {
    return all[random() % all.size()];
  }

  void begin_with(const std::string& sql) const {
    write_bytes(file, clean);
    RawFile(file).run(sql);
  }
  void write() const { MapFile(file, Access::kWrite).put({&other, 1}, note("put")); }

  /// Named by `check`, refused before it is written, and read all the same.
  void check_refused(const std::string& sql, const std::string& name) const {
    CAPTURE(sql);
    begin_with(sql);
    const Bytes before = read_bytes(file);
    CHECK(fault_of_work(file, [&] { write(); }) == Fault::kUntrusted);
    CHECK_THROWS_WITH(write(), Contains(name));
    CHECK((read_bytes(file) == before));
    CHECK_FALSE(std::filesystem::exists(file.string() + "-wal"));

    const MapFile reading(file, Access::kRead);
    const std::vector<std::string> findings = reading.check();
    CHECK(std::ranges::any_of(
        findings, [&](const std::string& line) { return line.find(name) != line.npos; }));
    CHECK(same(reading.read(1), map));
  }

  /// It may stay: maps are put in, taken back, and nothing of it is lost.
  void check_stays(const std::string& sql) const {
    CAPTURE(sql);
    begin_with(sql);
    write();
    MapFile(file, Access::kWrite).revert(1, note("back"));
    write();
    const MapFile reading(file, Access::kRead);
    CHECK(same(reading.read(1), map));
    CHECK(same(reading.read(2), other));
    CHECK(reading.history().size() == 4);
    for (const std::string& finding : reading.check())
      CHECK_THAT(finding, Contains("its definition was changed"));
  }
};

/// Tables that are written when a map is put in, or may be by other calls.
std::vector<std::string> our_tables() {
  std::vector<std::string> tables;
  for (const map_file::SchemaObject& one : map_file::schema_objects())
    if (one.sql.starts_with("CREATE TABLE")) tables.push_back(one.name);
  return tables;
}

const std::string kNotes =
    "CREATE TABLE notes (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POINT, a TEXT, "
    "landmark INTEGER);";
const std::string kCounts =
    "CREATE TABLE gpkg_ogr_contents(table_name TEXT NOT NULL PRIMARY KEY,feature_count INTEGER "
    "DEFAULT NULL);";

}  // namespace

TEST_CASE_METHOD(ForeignSql, "a trigger that acts when we write is refused by its name",
                 "[map_file]") {
  const std::vector<std::string> bodies{
      "SELECT 1", "DELETE FROM landmarks WHERE landmark_id % 2 = 0",
      "INSERT OR IGNORE INTO notes (a) VALUES ('seen')", "SELECT RAISE(IGNORE)",
      "UPDATE understory_maps SET name = name"};
  for (const std::string& table : our_tables()) {
    for (const char* const event : {"INSERT", "UPDATE", "DELETE"}) {
      const std::string name = fmt::format("foreign {} of a word", random() % 1000);
      check_refused(fmt::format("{} CREATE TRIGGER \"{}\" {} {} ON {} {} BEGIN {}; END", kNotes,
                                name, one_of<std::string>({"BEFORE", "AFTER"}), event, table,
                                one_of<std::string>({"", "WHEN 0", "FOR EACH ROW WHEN 1 = 1"}),
                                one_of(bodies)),
                    name);
    }
  }
}

TEST_CASE_METHOD(ForeignSql, "so is one on a single column, of any table of ours", "[map_file]") {
  for (const std::string& table : our_tables()) {
    const std::string columns =
        RawFile(file).rows(fmt::format("SELECT name FROM pragma_table_info('{}')", table));
    for (std::size_t at = 0; at < columns.size(); at = columns.find('\n', at) + 1) {
      const std::string column = columns.substr(at, columns.find('|', at) - at);
      check_refused(fmt::format("CREATE TRIGGER foreign_one AFTER UPDATE OF {} ON {} BEGIN SELECT "
                                "1; END",
                                column, table),
                    "foreign_one");
    }
  }
}

TEST_CASE_METHOD(ForeignSql, "triggers that are reached over other tables are refused",
                 "[map_file]") {
  const auto foreign = [](const std::string& event, const std::string& table) {
    return fmt::format("CREATE TRIGGER far_away AFTER {} ON {} BEGIN DELETE FROM landmarks; END;",
                       event, table);
  };
  // Over GDAL's count of features, and over a key of somebody else.
  check_refused(kCounts +
                    "CREATE TRIGGER trigger_insert_feature_count_landmarks AFTER INSERT ON "
                    "landmarks BEGIN UPDATE gpkg_ogr_contents SET feature_count = feature_count + "
                    "1 WHERE lower(table_name) = lower('landmarks'); END;" +
                    foreign("UPDATE", "gpkg_ogr_contents"),
                "far_away");
  check_refused(
      "CREATE TABLE marks (id INTEGER PRIMARY KEY, landmark INTEGER REFERENCES "
      "landmarks(landmark_id) ON DELETE CASCADE);" +
          foreign("DELETE", "marks"),
      "far_away");
  // Under the name of one of GDAL's, with another text.
  check_refused(kCounts +
                    "CREATE TRIGGER trigger_insert_feature_count_landmarks AFTER INSERT ON "
                    "landmarks BEGIN DELETE FROM landmarks; END",
                "trigger_insert_feature_count_landmarks");
}

TEST_CASE_METHOD(ForeignSql, "what has the name of something of ours and is something else",
                 "[map_file]") {
  for (const map_file::SchemaObject& one : map_file::schema_objects()) {
    if (!one.sql.starts_with("CREATE TRIGGER")) continue;
    const std::string head = one.sql.substr(0, one.sql.find("BEGIN"));
    check_refused(fmt::format("DROP TRIGGER {}; {} BEGIN SELECT 1; END", one.name, head), one.name);
  }
  check_refused(
      "DROP INDEX understory_submaps_to_draw; CREATE INDEX understory_submaps_to_draw "
      "ON understory_submap_poses(abs(x_m))",
      "understory_submaps_to_draw");
}

TEST_CASE_METHOD(ForeignSql, "a row of the schema that is called otherwise than what it defines",
                 "[map_file]") {
  // SQLite does not take it: names of rows can be relied on.
  for (const char* const change : {"name = 'innocent'", "tbl_name = 'notes'", "type = 'view'"}) {
    begin_with(kNotes + "CREATE TRIGGER odd AFTER INSERT ON landmarks BEGIN SELECT 1; END");
    RawFile(file).run(fmt::format(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET {} WHERE name = 'odd'", change));
    CHECK(fault_of_work(file, [&] { write(); }) == Fault::kDamaged);
  }
}

TEST_CASE_METHOD(ForeignSql, "computed columns, checks, keys and collations in our tables",
                 "[map_file]") {
  for (const char* const column :
       {"c TEXT AS (hex(geom))", "c TEXT GENERATED ALWAYS AS (kind) VIRTUAL", "c CHECK (c < 3)",
        "c INTEGER REFERENCES understory_maps(map_id)", "c TEXT COLLATE NOCASE",
        "c TEXT DEFAULT CURRENT_TIMESTAMP", "c TEXT CONSTRAINT x NOT NULL DEFAULT ''",
        "c \"odd\" AS (kind)", "c /* */ TEXT"}) {
    CAPTURE(column);
    write_bytes(file, clean);
    // SQLite adds some only where there are no rows.
    RawFile(file).run("DELETE FROM landmarks");
    RawFile(file).run(fmt::format("ALTER TABLE landmarks ADD COLUMN {}", column));
    CHECK(fault_of_work(file, [&] { write(); }) == Fault::kUntrusted);
    CHECK_THROWS_WITH(write(), Contains("landmarks: its definition is not ours"));
  }
  // Where no other program adds any.
  check_refused("ALTER TABLE understory_history ADD COLUMN c TEXT", "understory_history");
  check_refused("ALTER TABLE gpkg_contents ADD COLUMN c TEXT", "gpkg_contents");
}

TEST_CASE_METHOD(ForeignSql, "indexes that are more than columns, and other virtual tables",
                 "[map_file]") {
  for (const char* const index : {"CREATE UNIQUE INDEX odd ON landmarks(landmark_id, kind)",
                                  "CREATE INDEX odd ON landmarks(abs(times_seen))",
                                  "CREATE INDEX odd ON landmarks(kind) "
                                  "WHERE map_id = 1",
                                  "CREATE INDEX odd ON landmarks(kind COLLATE NOCASE)"})
    check_refused(index, "'odd'");
  check_refused("CREATE VIRTUAL TABLE odd USING rtree(id, minx, maxx, miny, maxy, +more)", "'odd'");
  check_refused("CREATE VIRTUAL TABLE odd USING rtree_i32(id, minx, maxx, miny, maxy)", "'odd'");
}

TEST_CASE_METHOD(ForeignSql, "names of others are one line of text", "[map_file]") {
  check_refused("CREATE TRIGGER \"a\nb\x1b[2J\" AFTER INSERT ON landmarks BEGIN SELECT 1; END",
                "'a?b?[2J'");
}

TEST_CASE_METHOD(ForeignSql, "what QGIS and GDAL add may stay", "[map_file]") {
  const std::string styles =
      "CREATE TABLE layer_styles (id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, f_table_name "
      "TEXT(256), styleQML TEXT, update_time DATETIME DEFAULT "
      "(strftime('%Y-%m-%dT%H:%M:%fZ','now')))";
  const std::string marks =
      "CREATE TABLE marks (id INTEGER PRIMARY KEY, landmark INTEGER REFERENCES "
      "landmarks(landmark_id) ON DELETE SET NULL)";
  const std::string columns =
      "ALTER TABLE landmarks ADD COLUMN \"my height\" REAL; "
      "ALTER TABLE landmarks ADD \"who\" TEXT(12) NOT NULL DEFAULT 'me'; "
      "ALTER TABLE landmarks ADD \"flag\" BOOLEAN DEFAULT -1; "
      "ALTER TABLE landmarks ADD size NUMERIC(8, 2) NULL";
  const std::vector<std::string> additions{
      kNotes + "CREATE TRIGGER notes_count AFTER INSERT ON notes BEGIN DELETE FROM landmarks; END",
      kNotes + "CREATE VIRTUAL TABLE \"rtree_notes_geom\" USING rtree(id, minx, maxx, miny, maxy)",
      styles,
      "CREATE VIEW thick AS SELECT * FROM landmarks WHERE diameter_m > 0.5",
      "CREATE INDEX \"landmarks_kind\" ON \"landmarks\"(\"kind\")",
      "ALTER TABLE landmarks ADD COLUMN remark TEXT(20)",
      columns,
      "ALTER TABLE trajectory ADD COLUMN remark TEXT",
      "ALTER TABLE understory_maps ADD COLUMN owner TEXT",
      marks};
  std::string all;
  for (const std::string& one : additions) check_stays(one);

  std::string counts = kCounts;
  for (const char* const table : {"landmarks", "trajectory", "understory_maps"}) {
    for (const auto& [event, sign] : {std::pair{"insert", '+'}, std::pair{"delete", '-'}})
      counts += fmt::format(
          "CREATE TRIGGER \"trigger_{0}_feature_count_{1}\" AFTER {0} ON "
          "\"{1}\" BEGIN UPDATE gpkg_ogr_contents SET feature_count = "
          "feature_count {2} 1 WHERE lower(table_name) = lower('{1}'); END;",
          event, table, sign);
  }
  check_stays(counts + "INSERT INTO gpkg_ogr_contents SELECT 'landmarks', count(*) FROM landmarks");
  CHECK(RawFile(file).rows("SELECT feature_count - (SELECT count(*) FROM landmarks) FROM "
                           "gpkg_ogr_contents") == "0|\n");
}

TEST_CASE_METHOD(ForeignSql, "indexes of places that GDAL has made anew are ours", "[map_file]") {
  std::string anew;
  for (const map_file::SchemaObject& one : map_file::schema_objects()) {
    if (!one.sql.starts_with("CREATE TRIGGER rtree_landmarks")) continue;
    std::string sql = one.sql;
    for (const std::string name :
         {"landmark_id", "NEW.geom", "OLD.geom", "rtree_landmarks_geom "}) {
      const std::size_t dot = name.find('.') + 1;
      const std::string bare = name.substr(dot, name.find(' ') - dot);
      const std::string by =
          name.substr(0, dot) + '"' + bare + '"' + (name.back() == ' ' ? " " : "");
      for (std::size_t at = 0; (at = sql.find(name, at)) != sql.npos; at += by.size())
        sql.replace(at, name.size(), by);
    }
    std::ranges::replace(sql, '\n', ' ');
    anew += fmt::format("DROP TRIGGER {}; {};", one.name, sql);
  }
  check_stays(anew);
  CHECK(MapFile(file, Access::kRead).check().empty());
}

TEST_CASE_METHOD(ForeignSql, "a statement in which a foreign trigger would run fails",
                 "[map_file]") {
  begin_with(
      "CREATE TRIGGER odd AFTER UPDATE ON landmarks BEGIN SELECT 1; END; "
      "CREATE VIEW some AS SELECT 1");
  const map_file::Connection connection(file, Access::kWrite, file);
  CHECK(fault_of_work(file, [&] { connection.execute("UPDATE landmarks SET kind = kind"); }) ==
        Fault::kUntrusted);
  CHECK(fault_of_work(file, [&] { connection.execute("SELECT * FROM some"); }) ==
        Fault::kUntrusted);
  CHECK(connection.number("SELECT count(*) FROM landmarks") ==
        static_cast<std::int64_t>(map.landmarks.size()));
}

TEST_CASE("definitions are compared by their words", "[map_file]") {
  using map_file::is_same_sql;
  CHECK(is_same_sql("CREATE TABLE t (a TEXT)", "create  table \"T\"(\n[a] `text` )"));
  CHECK_FALSE(is_same_sql("CREATE TABLE t (a INTEGER NOT NULL)",
                          "CREATE TABLE t (a INTEGER \"NOT\" NULL)"));
  CHECK_FALSE(is_same_sql("SELECT 'a'", "SELECT \"a\""));
  CHECK_FALSE(is_same_sql("SELECT 'a'", "SELECT 'A'"));
  CHECK_FALSE(is_same_sql("SELECT a", "SELECT a -- b"));
  CHECK_FALSE(is_same_sql("SELECT ab", "SELECT a b"));

  // Whatever is cut out of or put into a definition, no two that differ are the same.
  std::mt19937_64 random(5);
  const std::string sql = map_file::schema_objects()[8].sql;
  for (int i = 0; i < 2000; ++i) {
    std::string changed = sql;
    const std::size_t at = random() % sql.size();
    const char by = static_cast<char>(random() % 128);
    if (by == sql[at] || std::isspace(by) != 0 || std::isspace(sql[at]) != 0) continue;
    if (std::tolower(by) == std::tolower(sql[at])) continue;
    changed[at] = by;
    CAPTURE(changed);
    CHECK_FALSE(is_same_sql(sql, changed));
  }
}
