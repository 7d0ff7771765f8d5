// `understory map` as a user calls it.
#include <fmt/format.h>
#include <sqlite3.h>

#include <nlohmann/json.hpp>

#include "common/map_file/map_file.hpp"
#include "common/model/program_version.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Maps {
  TemporaryDirectory directory;
  std::string table = (directory / "stems.csv").string();
  std::string file = (directory / "maps.gpkg").string();

  Maps() { write(table, "x_m,y_m,dbh_m,kind\n1,2,0.3,trunk\n5,6,,corner\n9,9,0.2,\n"); }

  static void write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  Outcome run(const std::string& arguments) const {
    return understory_command(directory, "map " + arguments);
  }
  Outcome fine(const std::string& arguments) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    CHECK(outcome.status == 0);
    return outcome;
  }
  /// Ends with 1 and one line that has all of this.
  void refused(const std::string& arguments, const std::vector<std::string>& what) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    CHECK(outcome.status == 1);
    CHECK(lines(outcome.error) == 1);
    for (const std::string& part : what) CHECK_THAT(outcome.error, Contains(part));
  }
  nlohmann::json json(const std::string& arguments) const {
    return nlohmann::json::parse(fine(arguments + " --json").out);
  }
};

}  // namespace

TEST_CASE_METHOD(Maps, "a survey becomes a map, with its sigma", "[cli]") {
  CHECK_THAT(fine("import " + table + " --sigma-m 0.5 --out " + file).out,
             Contains("map 1 of 3 landmarks and 0 keyframes"));
  const auto map = map_file::MapFile(file, map_file::Access::kRead).read(1);
  REQUIRE(map.landmarks.size() == 3);
  CHECK(map.name == "stems");
  CHECK(map.origin == "stems.csv");
  CHECK(map.landmarks[1].landmark.id == map_file::landmark_id(1, 2));
  CHECK(map.landmarks[1].landmark.position_m == Eigen::Vector2d(5.0, 6.0));
  CHECK(map.landmarks[1].landmark.kind == model::LandmarkKind::kCorner);
  CHECK(map.landmarks[0].landmark.radius_m == 0.15);
  CHECK(map.landmarks[0].landmark.covariance_m2 == 0.25 * Eigen::Matrix2d::Identity());

  CHECK_THAT(fine("check " + file).out, Contains("1 maps, 1 changes, nothing wrong"));
  CHECK_THAT(fine("info " + file).out, Contains("stems (stems.csv)"));
  const auto info = json("info " + file);
  CHECK(info["maps"][0]["trunks"] == 2);
  CHECK(info["maps"][0]["corners"] == 1);
  CHECK(info["changes"] == 1);
  CHECK(info["version"] == model::program_version());
  CHECK(info["written_by"] == model::program_version());
  CHECK_THAT(fine("info " + file).out, Contains("written by version " + model::program_version()));

  // Scripts name standard output; the option may stand anywhere.
  const std::string text = fine("info --json " + file).out;
  for (const char* const order : {"{} --json -", "--json - {}", "--json {} -"}) {
    CAPTURE(order);
    CHECK(fine("info " + fmt::format(fmt::runtime(order), file)).out == text);
  }
  CHECK(run("info - " + file).status == 2);
  CHECK(run("info --json -").status == 2);
  CHECK(run("info " + file + " -").status == 2);
}

TEST_CASE_METHOD(Maps, "landmarks that stand close together are reported", "[cli]") {
  write(table, "x_m,y_m\n0,0\n5,5\n0.03,0\n");
  CHECK_THAT(fine("import " + table + " --out " + file).error,
             Contains("stems.csv: lines 2 and 4 are 0.030 m apart") && Contains("1 pairs"));
  CHECK(fine("import " + table + " --near-m 0.01 --out " + file).error.empty());
}

TEST_CASE_METHOD(Maps, "a table that is none ends with file and line, and makes nothing", "[cli]") {
  for (const auto& [text, what] : std::vector<std::pair<std::string, std::string>>{
           {"", "stems.csv: no heading"},
           {"x_m,y_m\n1,nan\n", "stems.csv, line 2"},
           {"x_m,y_m\n1,2\n1e300,2\n", "stems.csv, line 3"},
           {"x_m,height\n1,3\n", "no column for y"},
           {"x_m,y_m,kind\n1,2,bush\n", "stems.csv, line 2: kind 'bush'"}}) {
    write(table, text);
    refused("import " + table + " --out " + file, {what});
  }
  refused("import " + table + "x --out " + file, {"stems.csvx"});
  refused("import " + directory.path().string() + " --out " + file, {"cannot be read"});
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK(run("import " + table + " --sigma-m 0 --out " + file).status == 2);
  CHECK(run("import " + table).status == 2);
  CHECK(run("").status == 2);
}

TEST_CASE_METHOD(Maps, "maps are added, replaced when asked, and refused otherwise", "[cli]") {
  fine("import " + table + " --out " + file);
  CHECK_THAT(fine("import " + table + " --name second --out " + file).out, Contains("map 2"));
  fine("import " + table + " --map 9 --out " + file);
  refused("import " + table + " --map 2 --out " + file, {"maps.gpkg: has a map 2", "--replace"});
  write(table, "x_m,y_m\n1,1\n");
  fine("import " + table + " --map 2 --replace --out " + file);

  const auto info = json("info " + file);
  CHECK(info["maps"].size() == 3);
  CHECK(info["maps"][1]["trunks"] == 1);
  CHECK(info["maps"][2]["map_id"] == 9);
  CHECK(info["changes"] == 4);
}

TEST_CASE_METHOD(Maps, "log lists the changes, revert takes them back", "[cli]") {
  fine("import " + table + " --out " + file);
  write(table, "x_m,y_m\n1,1\n");
  fine("import " + table + " --map 1 --replace --out " + file);
  CHECK(json("info " + file)["maps"][0]["trunks"] == 1);
  const auto first = json("log " + file);
  REQUIRE(first["changes"].size() == 2);
  CHECK(first["changes"][1]["number"] == 2);
  CHECK(first["changes"][1]["command"] == "understory map import");
  CHECK(first["changes"][1]["source"] == "stems.csv");

  CHECK_THAT(fine("revert --to 1 " + file).out, Contains("as it was after change 1 (change 3)"));
  CHECK(json("info " + file)["maps"][0]["trunks"] == 2);
  CHECK_THAT(fine("log " + file).out, Contains("back to what was after change 1"));
  refused("revert --to 17 " + file, {"maps.gpkg: has no change 17, the latest one is 3"});
  CHECK(run("revert " + file).status == 2);
  fine("check " + file);
}

TEST_CASE_METHOD(Maps, "edits of another program are accepted when asked", "[cli]") {
  fine("import " + table + " --out " + file);
  refused("accept " + file, {"maps.gpkg: its maps are what its history says"});
  sqlite3* other = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &other) == SQLITE_OK);
  const char* const edit = "UPDATE understory_maps SET name = 'thinned'";
  CHECK(sqlite3_exec(other, edit, nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(other);
  CHECK_THAT(run("check " + file).out, Contains("changed by another program"));

  CHECK_THAT(fine("accept " + file).out, Contains("is change 2 now"));
  fine("check " + file);
  CHECK(json("info " + file)["maps"][0]["name"] == "thinned");
  fine("revert --to 1 " + file);
  CHECK(json("info " + file)["maps"][0]["name"] == "stems");
}

TEST_CASE_METHOD(Maps, "diff tells what was added, removed and moved", "[cli]") {
  const std::string later = (directory / "later.gpkg").string();
  fine("import " + table + " --out " + file);
  write(table, "x_m,y_m\n1.05,2\n6,6\n");
  fine("import " + table + " --out " + later);
  const auto text = fine("diff " + file + " " + later).out;
  CHECK_THAT(text, Contains("map 1: 0 added, 1 removed, 1 moved, 1 kept") &&
                       Contains("by 1.000 m, chi2 50.0") &&
                       Contains("frames taken to be the same"));
  const auto back = json("diff " + later + " " + file + " --quantile 0.05");
  CHECK(back["maps"][0]["added"].size() == 1);
  CHECK(back["maps"][0]["moved"].size() == 2);
  CHECK(back["quantile"] == 0.05);
  CHECK(back["unknown_sigma_m"] == 0.1);
  CHECK(run("diff " + file + " " + later + " --quantile 2").status == 2);
  refused("diff " + file + " " + later + "x", {"later.gpkgx"});
}

TEST_CASE_METHOD(Maps, "diff tells what left use and what came back between two states of a file",
                 "[cli]") {
  fine("import " + table + " --out " + file);
  map_file::StoredMap map = map_file::MapFile(file, map_file::Access::kRead).read(1);
  const auto drive = [&](double first, double second) {
    map_file::StoredExistence existence{1, "learned", {}};
    existence.landmarks = {{{map_file::landmark_id(1, 1), first, first > 0.5}, 1, "state"},
                           {{map_file::landmark_id(1, 2), second, second > 0.5}, 1, "state"},
                           {{map_file::landmark_id(1, 3), 0.5 + 0.1 * first, true}, 1, "state"}};
    map_file::give_existence(map, existence);
    map_file::MapFile(file, map_file::Access::kWrite).put({&map, 1}, {1, "a test", "", "a drive"});
  };
  drive(0.9, 0.05);
  const std::string earlier = (directory / "earlier.gpkg").string();
  std::filesystem::copy_file(file, earlier);
  drive(0.02, 0.95);

  const auto text = fine("diff " + earlier + " " + file).out;
  CHECK_THAT(text, Contains("existence: 1 left use, 1 used again, 0 more probabilities changed"));
  CHECK_THAT(text, Contains("probability 0.900 -> 0.020") && Contains("left use"));
  CHECK_THAT(text, Contains("probability 0.050 -> 0.950") && Contains("used again"));
  const auto json_text = json("diff " + earlier + " " + file + " --probability-change 0.05");
  const auto& changes = json_text["maps"][0]["existence"];
  REQUIRE(changes.size() == 3);
  CHECK(changes[0]["was_in_use"] == true);
  CHECK(changes[0]["is_in_use"] == false);
  CHECK(changes[2]["probability_before"] == 0.59);
  CHECK_FALSE(Contains("existence").match(fine("diff " + file + " " + file).out));

  const auto out = directory / "out";
  fine("export " + file + " --out " + out.string());
  CHECK_THAT(read_text(out / "map-1" / "landmarks.csv"),
             Contains(",0.02,0\n") && Contains(",0.95,1\n"));

  // The same of a revision of the file itself.
  fine("revert --to 1 " + earlier);
  CHECK_THAT(fine("diff " + earlier + " " + file).out, Contains("unknown -> 0.020"));
  CHECK(run("diff " + file + " " + file + " --probability-change 2").status == 2);
}

TEST_CASE_METHOD(Maps, "export writes what other tools read", "[cli]") {
  fine("import " + table + " --out " + file);
  const auto out = directory / "out";
  fine("export " + file + " --out " + out.string());
  CHECK_THAT(read_text(out / "map-1" / "landmarks.csv"),
             Contains("id,x_m,y_m") && Contains("281474976710658,5,6,") && Contains(",,\n"));
  CHECK_THAT(read_text(out / "map-1" / "keyframes.csv"), Contains("keyframe,utime_us"));
  CHECK(run("export " + file + " --out x --format kml").status == 2);
}

TEST_CASE_METHOD(Maps, "an exported table of landmarks comes back with its radii", "[cli]") {
  fine("import " + table + " --out " + file);
  fine("export " + file + " --out " + (directory / "out").string());
  const std::string again = (directory / "again.gpkg").string();
  fine("import " + (directory / "out" / "map-1" / "landmarks.csv").string() + " --out " + again);
  const auto before = map_file::MapFile(file, map_file::Access::kRead).read(1);
  const auto after = map_file::MapFile(again, map_file::Access::kRead).read(1);
  REQUIRE(after.landmarks.size() == before.landmarks.size());
  for (std::size_t i = 0; i < after.landmarks.size(); ++i) {
    CHECK(after.landmarks[i].landmark.position_m == before.landmarks[i].landmark.position_m);
    CHECK(after.landmarks[i].landmark.radius_m == before.landmarks[i].landmark.radius_m);
  }
}

TEST_CASE_METHOD(Maps, "export as GeoJSON has every property of a landmark", "[cli]") {
  write(table, "east,north,dbh_m,kind\n401001,5654002,0.3,trunk\n401005,5654006,,corner\n");
  fine("import " + table + " --crs EPSG:25832 --out " + file);
  const auto out = directory / "out";
  fine("export " + file + " --format geojson --out " + out.string());
  const auto layer = nlohmann::json::parse(read_text(out / "map-1" / "landmarks.geojson"));
  CHECK(layer["type"] == "FeatureCollection");
  REQUIRE(layer["features"].size() == 2);
  const auto& one = layer["features"][1];
  CHECK(one["geometry"]["type"] == "Point");
  CHECK(one["geometry"]["coordinates"].size() == 2);
  CHECK(one["properties"]["kind"] == "corner");
  CHECK(one["properties"]["diameter_m"].is_null());
  CHECK(one["properties"]["covariance_m2"][0].size() == 2);
  CHECK(nlohmann::json::parse(read_text(out / "map-1" / "trajectory.geojson"))["features"].empty());
}

TEST_CASE_METHOD(Maps, "info leaves what a killed writer left as it is, and says so", "[cli]") {
  fine("import " + table + " --out " + file);
  in_child([&] {
    MapFile writing(file, Access::kWrite);
    writing.revert(0, note("killed behind it"));
    ::_exit(0);
    return 0;
  });
  const std::string log = file + "-wal";
  const Bytes bytes = read_bytes(file);
  const Bytes in_log = read_bytes(log);
  const Outcome outcome = fine("info " + file);
  CHECK_THAT(outcome.out, Contains(file + ": 0 maps, 2 changes"));
  CHECK_THAT(outcome.error, Contains("maps.gpkg-wal lies beside it: a writer was killed"));
  CHECK(lines(outcome.error) == 1);
  CHECK((read_bytes(file) == bytes));
  CHECK((read_bytes(log) == in_log));
  fine("check " + file);
  CHECK_FALSE(std::filesystem::exists(log));
  CHECK(fine("info " + file).error.empty());
}

TEST_CASE_METHOD(Maps, "every part names a file that is no map", "[cli]") {
  for (const char* const command : {"info", "check", "log", "revert --to 0", "export --out o"}) {
    refused(std::string(command) + " " + table, {"stems.csv: no map file"});
    refused(std::string(command) + " " + file, {"maps.gpkg: there is no such file"});
  }
  refused("import " + table + " --out " + table, {"stems.csv: no map file"});
  CHECK_THAT(read_text(table), Contains("x_m,y_m,dbh_m,kind"));
}

TEST_CASE_METHOD(Maps, "check ends with 1 and says what is wrong", "[cli]") {
  fine("import " + table + " --out " + file);
  auto bytes = read_bytes(file);
  // The name of the map in its row.
  const std::string name = "stemsstems.csv";
  for (auto at = bytes.begin();
       (at = std::search(at, bytes.end(), name.begin() + 5, name.end())) != bytes.end(); ++at)
    *at = 'S';
  write_bytes(file, bytes);
  const Outcome outcome = run("check " + file);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.out, Contains("map 1: is not what its checksum says"));
  CHECK_THAT(outcome.error, Contains("maps.gpkg: ") && Contains("findings"));
  refused("export --out o " + file, {"maps.gpkg: map 1 is not what its checksum says"});
}

TEST_CASE_METHOD(Maps, "without room for it no map file is left", "[cli]") {
  std::string many = "x_m,y_m\n";
  for (int i = 0; i < 20'000; ++i) many += fmt::format("{},{}\n", i % 200, i / 200);
  write(table, many);
  const std::string limited = "trap '' XFSZ; ulimit -f 400; " + std::string(UNDERSTORY_COMMAND) +
                              " map import " + table + " --out " + file + " 2> " +
                              (directory / "e").string();
  const int status = std::system(limited.c_str());  // NOLINT(cert-env33-c)
  CHECK(WEXITSTATUS(status) == 1);
  const std::string error = read_text(directory / "e");
  CHECK(lines(error) == 1);
  CHECK_THAT(error, Contains("maps.gpkg: no room"));
  for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
    CHECK_THAT(entry.path().filename().string(), !Contains("gpkg"));
}
