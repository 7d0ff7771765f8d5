// Maps out of logs.
#include <nlohmann/json.hpp>

#include "common/map_file/map_file.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/log_maps.hpp"
#include "deploy/cli/slam_results.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

model::MapLandmark landmark(std::uint32_t map_id, std::uint64_t counter, double x) {
  model::MapLandmark one;
  one.id = map_file::landmark_id(map_id, counter);
  one.position_m.x() = x;
  one.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  return one;
}

/// A log as a mapper would write it.
struct MapperLog {
  std::vector<io::LogEvent> events;
  model::Utime utime = 0;
  std::uint64_t version = 0;

  template <class Message>
  void add(const std::string& channel, Message message) {
    message.utime = ++utime;
    io::LogEvent event;
    event.number = static_cast<std::int64_t>(events.size());
    event.utime = utime;
    event.channel = channel;
    event.data = wire::encode_message(message);
    events.push_back(event);
  }
  void update(std::uint32_t map_id, bool starts, bool is_provisional) {
    model::MapUpdate update;
    update.keyframe_sequence = events.size();
    update.status = starts ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;
    update.map_id = map_id;
    update.is_provisional = is_provisional;
    add("SLAM_UPDATE", update);
  }
  void delta(bool is_first, const std::vector<model::MapLandmark>& added) {
    model::MapDelta delta;
    delta.base_version = is_first ? 0 : version;
    delta.version = ++version;
    delta.added = added;
    add("MAP_DELTA", delta);
  }
  void existence(std::uint32_t map_id, const std::vector<std::uint64_t>& counters,
                 const std::string& state) {
    model::ExistenceState message;
    message.map_id = map_id;
    message.model = "model " + state;
    for (const std::uint64_t counter : counters) {
      message.landmarks.push_back({map_file::landmark_id(map_id, counter), 0.25, false});
      message.states += state;
    }
    add("EXISTENCE_STATE", message);
  }
  void write(const std::filesystem::path& file) const {
    io::LcmLogWriter writer(file);
    for (const io::LogEvent& event : events) writer.write(event);
    writer.commit();
  }
  std::map<std::uint32_t, cli::LogMaps::Found> maps() const {
    cli::LogMaps maps;
    for (const io::LogEvent& event : events) maps.add(event);
    return maps.take();
  }
};

}  // namespace

TEST_CASE("each map of a log is found as it was last", "[cli]") {
  MapperLog log;
  log.update(1, true, true);
  log.delta(true, {landmark(1, 1, 0.0)});
  log.update(1, false, false);
  log.delta(false, {landmark(1, 2, 5.0)});
  log.update(2, true, false);
  log.delta(true, {landmark(2, 1, 1.0), landmark(2, 2, 2.0), landmark(2, 3, 3.0)});
  log.update(2, false, false);
  const auto maps = log.maps();
  REQUIRE(maps.size() == 2);
  CHECK(maps.at(1).map.landmarks.size() == 2);
  CHECK(maps.at(1).map.keyframes.size() == 2);
  CHECK(maps.at(2).map.landmarks.size() == 3);
  CHECK(maps.at(2).map.keyframes.size() == 2);
  CHECK(maps.at(2).missed == 0);
}

TEST_CASE("a provisional map that gave way is none, one at the end is", "[cli]") {
  MapperLog log;
  log.update(1, true, true);
  log.delta(true, {landmark(1, 1, 0.0)});
  log.update(2, true, true);
  log.delta(true, {landmark(2, 1, 1.0)});
  const auto maps = log.maps();
  REQUIRE(maps.size() == 1);
  CHECK(maps.contains(2));
}

TEST_CASE("a map that became part of a later one is in the later one only", "[cli]") {
  MapperLog log;
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0)});
  log.update(2, true, false);
  log.delta(true, {landmark(2, 1, 1.0)});
  log.update(2, false, false);
  log.delta(false, {landmark(1, 1, 7.0)});
  const auto maps = log.maps();
  REQUIRE(maps.size() == 1);
  CHECK(maps.at(2).map.landmarks.size() == 2);
}

TEST_CASE("a log that begins in the middle of a map gives it from its first MAP on", "[cli]") {
  MapperLog log;
  log.version = 7;
  log.update(3, false, false);
  log.delta(false, {landmark(3, 9, 0.0)});
  CHECK(log.maps().empty());
  model::WholeMap whole;
  whole.version = 8;
  whole.landmarks = {landmark(3, 9, 0.0), landmark(3, 10, 4.0)};
  log.add("MAP", whole);
  log.version = 9;
  log.delta(false, {landmark(3, 11, 8.0)});
  const auto maps = log.maps();
  REQUIRE(maps.size() == 1);
  CHECK(maps.at(3).map.landmarks.size() == 3);
  CHECK(maps.at(3).missed == 1);
}

TEST_CASE("states of existence are those of a map's landmarks; empty ones are passed over",
          "[cli]") {
  MapperLog log;
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0), landmark(1, 2, 0.0)});
  log.existence(1, {1}, "first");
  log.update(2, true, false);
  log.existence(1, {2}, "late");
  // A map that was left has its own, also those that came later.
  REQUIRE(log.maps().at(1).existence);
  CHECK(log.maps().at(1).existence->landmarks.size() == 2);
  // The map that was left becomes part of the next one, as far as the log tells.
  log.delta(true, {landmark(1, 2, 3.0), landmark(2, 1, 1.0), landmark(2, 2, 1.0)});
  log.existence(2, {1}, "second");
  log.existence(2, {2}, "");
  const auto maps = log.maps();
  CHECK_FALSE(maps.contains(1));
  REQUIRE(maps.at(2).existence);
  REQUIRE(maps.at(2).existence->landmarks.size() == 2);
  CHECK(maps.at(2).existence->landmarks[0].state == "late");
  CHECK(maps.at(2).existence->landmarks[1].state == "second");
  CHECK(maps.at(2).existence->learned == "model second");
}

TEST_CASE("landmarks of a log come with what was told of their existence last", "[cli]") {
  MapperLog log;
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0), landmark(1, 2, 5.0), landmark(1, 3, 9.0)});
  model::Existence told;
  told.landmarks = {{map_file::landmark_id(1, 1), 0.875, true},
                    {map_file::landmark_id(1, 2), 0.75, true}};
  log.add("EXISTENCE", told);
  log.existence(1, {2}, "state");

  cli::SlamResults results;
  for (const io::LogEvent& event : log.events) results.add(event);
  const std::string csv = cli::landmarks_csv(results.map.whole().value(), results.existence);
  CHECK_THAT(csv, Contains("times_seen,existence,in_use\n"));
  CHECK_THAT(csv, Contains("281474976710657,0,0,0.01,0,0.01,0,0,0.875,1\n"));
  CHECK_THAT(csv, Contains("281474976710658,5,0,0.01,0,0.01,0,0,0.25,0\n"));
  CHECK_THAT(csv, Contains("281474976710659,9,0,0.01,0,0.01,0,0,,\n"));
}

TEST_CASE("states of existence of a log's maps, those of a mapper that began anew", "[cli]") {
  MapperLog log;
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0), landmark(1, 2, 0.0), landmark(1, 3, 0.0)});
  log.existence(1, {1, 2}, "first");
  log.existence(1, {2, 3}, "second");
  const auto states = [&] {
    std::string text;
    for (const auto& row : log.maps().at(1).existence->landmarks) text += row.state + " ";
    return text;
  };
  CHECK(states() == "first second second ");
  CHECK(log.maps().at(1).existence->learned == "model second");
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0)});
  CHECK_FALSE(log.maps().at(1).existence);
  log.existence(1, {1}, "anew");
  CHECK(states() == "anew ");
}

TEST_CASE("what is imported has the states of its landmarks, and says so", "[cli]") {
  const TemporaryDirectory directory;
  const std::string file = (directory / "maps.gpkg").string();
  MapperLog log;
  log.update(1, true, false);
  log.delta(true, {landmark(1, 1, 0.0), landmark(1, 2, 5.0)});
  log.existence(1, {2, 9}, "state");
  log.write(directory / "drive.lcm");
  const auto run = [&](const std::string& arguments) {
    const Outcome outcome = understory_command(directory, arguments);
    CAPTURE(arguments, outcome.error);
    REQUIRE(outcome.status == 0);
    return outcome.out;
  };
  CHECK_THAT(run("map import " + (directory / "drive.lcm").string() + " --out " + file),
             Contains("map 1 of 2 landmarks and 1 keyframes (1 with a state of existence)"));
  run("map check " + file);
  CHECK_THAT(run("map info " + file),
             Contains("map 1: 1 landmarks have a state of existence, 1 of them are not in use"));
  const auto info = nlohmann::json::parse(run("map info --json " + file));
  CHECK(info["maps"][0]["existence_states"] == 1);
  CHECK(info["maps"][0]["not_in_use"] == 1);

  {
    const std::string points =
        "map_x_m,map_y_m,east,north\n0,0,401000,5654000\n9,0,401009,5654000\n";
    write_bytes(directory / "points.csv", Bytes(points.begin(), points.end()));
    run("map georeference " + file + " --crs EPSG:25832 --control-points " +
        (directory / "points.csv").string());
  }
  run("map export " + file + " --format geojson --out " + (directory / "out").string());
  const auto layer =
      nlohmann::json::parse(read_text(directory / "out" / "map-1" / "landmarks.geojson"));
  CHECK(layer["features"][0]["properties"]["existence"].is_null());
  CHECK(layer["features"][0]["properties"]["in_use"].is_null());
  CHECK(layer["features"][1]["properties"]["existence"] == 0.25);
  CHECK(layer["features"][1]["properties"]["in_use"] == false);

  const auto messages = map_file::existence_of(map_file::MapFile(file, map_file::Access::kRead), 1);
  REQUIRE(messages.size() == 1);
  CHECK(messages[0].states == "state");
}

TEST_CASE("a drive in a given map that began another map: the import names the other one",
          "[cli]") {
  const TemporaryDirectory directory;
  const auto run = [&](const std::string& arguments) {
    return understory_command(directory, arguments);
  };
  const auto path = [&](const char* name) { return (directory / name).string(); };
  MapperLog before;
  before.update(1, true, false);
  before.delta(true, {landmark(1, 1, 0.0)});
  before.write(path("before.lcm"));
  const std::string file = path("given.gpkg");
  REQUIRE(run("map import " + path("before.lcm") + " --out " + file).status == 0);

  MapperLog lost;
  lost.update(1, true, false);
  lost.delta(true, {landmark(1, 1, 0.0), landmark(1, 2, 5.0)});
  lost.update(2, true, false);
  lost.delta(true, {landmark(2, 1, 1.0)});
  lost.write(path("lost.lcm"));
  const Outcome kept =
      run("map import " + path("lost.lcm") + " --same-frame --replace --out " + file);
  CAPTURE(kept.error);
  REQUIRE(kept.status == 0);
  CHECK_THAT(kept.error, Contains("map 2 is not imported") && Contains("in another frame"));
  CHECK_THAT(kept.out, Contains("map 1 of 2 landmarks") && !Contains("map 2"));

  // The old map became part of the new one, in the new one's frame.
  MapperLog& joined = lost;
  joined.update(2, false, false);
  joined.delta(false, {landmark(1, 1, 7.0), landmark(1, 2, 12.0)});
  joined.write(path("joined.lcm"));
  for (const std::string options : {" --same-frame --replace", " --same-frame"}) {
    const Outcome none = run("map import " + path("joined.lcm") + options + " --out " + file);
    CHECK(none.status == 1);
    CHECK_THAT(none.error, Contains("map 2 is not imported") && !Contains("UNIQUE"));
  }
  const Outcome beside = run("map import " + path("joined.lcm") + " --out " + file);
  CHECK(beside.status == 1);
  CHECK_THAT(beside.error, Contains("map 1 became part of map 2") && !Contains("UNIQUE"));
  CHECK(run("map import " + path("joined.lcm") + " --out " + path("own.gpkg")).status == 0);
  CHECK(run("map check " + file).status == 0);
}

TEST_CASE("a drive becomes a map file", "[cli]") {
  const TemporaryDirectory directory;
  const std::string drive = (directory / "drive.lcm").string();
  const std::string mapped = (directory / "mapped.lcm").string();
  const std::string file = (directory / "maps.gpkg").string();
  const auto run = [&](const std::string& arguments) {
    const Outcome outcome = understory_command(directory, arguments);
    CAPTURE(arguments, outcome.error);
    return outcome;
  };
  REQUIRE(run("sim intermediate --length 30 --seed 5 --out " + drive).status == 0);
  REQUIRE(
      run("replay " + drive + " --config " UNDERSTORY_SOURCE_CONFIG " --out " + mapped).status ==
      0);

  CHECK_THAT(run("map import " + drive + " --out " + file).error, Contains("run replay first"));
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK(run("map import " + mapped + " --map 3 --out " + file).status == 2);
  REQUIRE(run("map import " + mapped + " --out " + file).status == 0);
  CHECK(run("map check " + file).status == 0);
  CHECK_THAT(run("map import " + mapped + " --out " + file).error, Contains("has a map 1 already"));

  // The same map as `export` gives, in the same bytes.
  REQUIRE(run("export " + mapped + " --format csv --out " + (directory / "a").string()).status ==
          0);
  REQUIRE(run("map export " + file + " --out " + (directory / "b").string()).status == 0);
  for (const std::string name : {"landmarks.csv", "keyframes.csv"}) {
    const std::string text = read_text(directory / "a" / name);
    CHECK(lines(text) > 5);
    CHECK(text == read_text(directory / "b" / "map-1" / name));
  }

  // Nothing has changed: a change without rows.
  REQUIRE(run("map import --replace " + mapped + " --out " + file).status == 0);
  const auto log = nlohmann::json::parse(run("map log --json " + file).out);
  CHECK(log["changes"][1]["bytes"].get<int>() < 200);
  CHECK_THAT(run("map diff " + file + " " + file).out, Contains(" 0 added, 0 removed, 0 moved"));
}

TEST_CASE("what is named as a log and is none ends with 1", "[cli]") {
  const TemporaryDirectory directory;
  const auto log = directory / "other.lcm";
  write_bytes(log, Bytes(1000, 'x'));
  const auto outcome = understory_command(
      directory, "map import " + log.string() + " --out " + (directory / "m.gpkg").string());
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error, Contains("other.lcm: no LCM log"));
  CHECK_FALSE(std::filesystem::exists(directory / "m.gpkg"));
}
