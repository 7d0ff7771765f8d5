// `replay --map` and `launch --map`: a map to begin with.
#include <fmt/format.h>
#include <sys/wait.h>

#include <nlohmann/json.hpp>
#include <random>

#include "common/io/lcm_log.hpp"
#include "common/map_file/map_file.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/given_map_option.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/ground_truth_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

constexpr const char* kDrive = "sim intermediate --length 40 --seed 5 --out ";
constexpr const char* kConfig = " --config " UNDERSTORY_SOURCE_CONFIG;

struct GivenMap {
  TemporaryDirectory directory;
  std::string drive = path("drive.lcm");
  std::string again = path("again.lcm");
  std::string map = path("forest.gpkg");

  std::string path(const char* name) const { return (directory / name).string(); }
  Outcome run(const std::string& arguments) const {
    return understory_command(directory, arguments);
  }
  void fine(const std::string& arguments) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    REQUIRE(outcome.status == 0);
  }
  void refused(const std::string& arguments, int status, const std::string& what) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    CHECK(outcome.status == status);
    CHECK(lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Contains(what));
  }

  /// A drive, and the map that it gives.
  void drive_and_map() const {
    fine(kDrive + drive);
    fine("replay " + drive + kConfig + " --out " + path("mapped.lcm"));
    fine("map import " + path("mapped.lcm") + " --out " + map);
  }
  /// A survey of three stems.
  void survey(const std::string& options = "") const {
    const std::string text = "x_m,y_m\n1,2\n5,6\n9,1\n";
    write_bytes(directory / "stems.csv", Bytes(text.begin(), text.end()));
    fine("map import " + path("stems.csv") + " --out " + map + options);
  }
};

/// What the mapper said in a log.
struct Said {
  std::size_t poses = 0;
  std::size_t lost = 0;
  std::size_t deltas = 0;
  double first_lost_s = -1.0;  ///< After the first scan; negative: never.
  double farthest_m = 0.0;     ///< Of a pose from the truth, in the frame of the first pose.
};

Said said_in(const std::string& log) {
  Said said;
  std::map<model::Utime, geometry::SE2> truth;
  std::optional<geometry::SE2> map_T_world;
  std::optional<std::int64_t> first_utime;
  io::LcmLogReader reader(log);
  while (const auto event = reader.next()) {
    if (event->channel == "MAP_DELTA") ++said.deltas;
    if (event->channel == "LANDMARKS" && !first_utime) first_utime = event->utime;
    if (event->channel == "GROUND_TRUTH") {
      const auto one = wire::decode_message<ground_truth_t>(event->data);
      truth[one->utime] = wire::from_wire(one->world_T_vehicle);
    }
    if (event->channel != "SLAM_POSE") continue;
    const auto pose = wire::decode_message<model::SlamPose>(event->data);
    if (!pose->is_localised()) {
      if (++said.lost == 1)
        said.first_lost_s = 1e-6 * static_cast<double>(event->utime - *first_utime);
      continue;
    }
    ++said.poses;
    const geometry::SE2 world_T_vehicle = truth.at(pose->utime);
    if (!map_T_world) map_T_world = pose->map_T_vehicle() * world_T_vehicle.inverse();
    const double off_m =
        (pose->map_T_vehicle().translation() - *map_T_world * world_T_vehicle.translation()).norm();
    said.farthest_m = std::max(said.farthest_m, off_m);
  }
  return said;
}

}  // namespace

TEST_CASE_METHOD(GivenMap, "a survey that is exact has exact landmarks", "[cli]") {
  // Stems far beyond both ends of the drive, which TRUTH_LANDMARKS does not have.
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> along_m(0.0, 600.0);
  std::uniform_real_distribution<double> across_m(0.0, 90.0);
  std::string text = "x_m,y_m\n";
  for (int i = 0; i < 1200; ++i)
    text += fmt::format("{:.4f},{:.4f}\n", along_m(random), across_m(random));
  write_bytes(directory / "stems.csv", Bytes(text.begin(), text.end()));
  fine("map import " + path("stems.csv") + " --near-m 0 --out " + map);
  fine("sim " + path("stems.csv") + " --path line --length 40 --seed 2 --out " + drive);

  for (const std::string options : {" --localisation-only", ""}) {
    CAPTURE(options);
    fine("replay " + drive + kConfig + " --stages keyframer,geoslam_mapper --map " + map + options +
         " --out " + again);
    fine("log accuracy " + again + " --json " + path("a.json"));
    const auto accuracy = nlohmann::json::parse(read_text(path("a.json")));
    CHECK_THAT(accuracy["map_tied_at"].get<std::string>(), Contains("the world's"));
    CHECK(accuracy["landmarks_compared"].get<int>() > 100);
    CHECK(accuracy["landmarks_compared"].get<int>() < accuracy["landmarks"].get<int>() - 300);
    // The map that stays as it is is the world; one that grows moves within its noise.
    CHECK(accuracy["lpe_cm"].get<double>() < (options.empty() ? 10.0 : 1e-6));
    CHECK(accuracy["live_rmse_cm"].get<double>() < 15.0);
  }
}

TEST_CASE_METHOD(GivenMap, "a replay goes on in the map of an earlier drive", "[cli]") {
  drive_and_map();
  const Bytes before = read_bytes(map);
  fine("replay " + drive + kConfig + " --map " + map + " --localisation-only --out " + again);
  const Said only = said_in(again);
  CHECK(only.poses > 100);
  CHECK(only.deltas == 0);
  CHECK(only.farthest_m < 0.5);
  CHECK((read_bytes(map) == before));

  // The configuration in force is in the log, the layer's values in it.
  std::string config;
  io::LcmLogReader reader(again);
  while (const auto event = reader.next()) {
    if (event->channel == "CONFIG") config += std::string(event->data.begin(), event->data.end());
  }
  CHECK_THAT(config, Contains("localisation_only = true") && Contains(map));

  // Without the flag the map grows.
  fine("replay " + drive + kConfig + " --map " + map + " --out " + path("grown.lcm"));
  CHECK(said_in(path("grown.lcm")).deltas > 0);
  CHECK((read_bytes(map) == before));
}

TEST_CASE_METHOD(GivenMap, "in somebody else's map the vehicle is lost at once and has no pose",
                 "[cli]") {
  fine("sim intermediate --length 40 --seed 9 --out " + path("other.lcm"));
  fine("replay " + path("other.lcm") + kConfig + " --out " + path("mapped.lcm"));
  fine("map import " + path("mapped.lcm") + " --out " + map);
  fine(kDrive + drive);
  fine("replay " + drive + kConfig + " --map " + map + " --localisation-only --out " + again);
  const Said said = said_in(again);
  CHECK(said.poses == 0);
  CHECK(said.lost > 20);
  CHECK(said.first_lost_s <= 2.0);
  CHECK(said.deltas == 0);
}

TEST_CASE_METHOD(GivenMap, "a given map replaces what the configuration names", "[cli]") {
  drive_and_map();
  std::filesystem::create_directory(directory / "config");
  const auto write = [&](const std::string& name, const std::string& text) {
    write_bytes(directory / "config" / name, Bytes(text.begin(), text.end()));
  };
  write("launch.toml", "base = \"" UNDERSTORY_SOURCE_CONFIG "\"\n");
  write("geoslam_mapper.toml", "base = \"" UNDERSTORY_SOURCE_CONFIG
                               "/geoslam_mapper.toml\"\n[input]\nmap_file = \"nowhere.gpkg\"\n"
                               "[smoothing]\nlocalisation_only = true\n");
  const std::string config = " --config " + path("config");
  refused("replay " + drive + config + " --out " + again, 1, "nowhere.gpkg");
  fine("replay " + drive + config + " --map " + map + " --out " + again);
  CHECK(said_in(again).deltas == 0);
}

TEST_CASE_METHOD(GivenMap, "a map that cannot be given ends replay and launch in one line",
                 "[cli]") {
  fine(kDrive + drive);
  const std::string replay = "replay " + drive + kConfig + " --out " + again + " --map ";
  const std::string launch = std::string("launch --quiet --state-dir ") + path("state") + kConfig +
                             " --lcm-url memq:// --map ";
  for (const std::string& command : {replay, launch}) {
    refused(command + map, 1, "forest.gpkg: there is no such file");
    refused(command + drive, 1, "drive.lcm: no map file");
  }
  CHECK(run("replay " + drive + " --localisation-only --out " + again).status == 2);
  CHECK(run("launch --localisation-only").status == 2);

  survey();
  refused(replay + map + " --stages keyframer", 2, "no geoslam_mapper runs, only: keyframer");
  refused(launch + map + " --only keyframer", 2, "no geoslam_mapper runs, only: keyframer");
  refused(replay + map + " --map-id 7", 1, "forest.gpkg: input.map_id is 7, the file has map 1");
  survey(" --map 7");
  refused(replay + map, 1, "the file has map 1, 7; say which one");
  fine(replay + map + " --map-id 7");
  CHECK_FALSE(std::filesystem::exists(directory / "state"));
}

TEST_CASE_METHOD(GivenMap, "a map without landmarks leaves the choice to the others", "[cli]") {
  fine(kDrive + drive);
  survey();
  map_file::StoredMap empty;
  empty.map_id = 2;
  map_file::MapFile(map, map_file::Access::kWrite).put({&empty, 1}, {});
  fine("replay " + drive + kConfig + " --map " + map + " --out " + again);
}

TEST_CASE_METHOD(GivenMap, "launch gives the map for good, and a state of another one first",
                 "[cli]") {
  survey();
  const auto folder = directory / "state" / "geoslam_mapper";
  std::filesystem::create_directories(folder);
  const auto layer = [&] {
    return cli::given_map_layers({.file = map, .localisation_only = true}, map,
                                 {"geoslam_mapper", "existence_tracker"});
  };
  // As in a process of its own: fail() ends the command.
  const auto keeps = [&] {
    try {
      const cli::GivenMapLayers given = layer();
      cli::keep_layer(folder, {}, given.layers.at("geoslam_mapper"), given.checksum);
      return true;
    } catch (const CLI::RuntimeError& error) {
      CHECK(error.get_exit_code() == 1);
      return false;
    }
  };

  // The existence tracker goes on with the map's states, and needs no more than the file.
  CHECK(layer().layers.at("existence_tracker").table.size() == 1);

  CHECK(keeps());
  const std::string text = read_text(cli::layer_file(folder));
  CHECK_THAT(text, Contains(map) && Contains("localisation_only = true") && !Contains("base"));
  write_bytes(folder / "geoslam_mapper.snapshot", Bytes(10, 'x'));
  CHECK(keeps());  // The next launch of the same drive goes on with its state.
  survey(" --map 1 --replace --sigma-m 0.4");
  CHECK_FALSE(keeps());  // The file has the same name, the map is another one.
  CHECK(read_text(cli::layer_file(folder)) == text);
  std::filesystem::remove(folder / "geoslam_mapper.snapshot");
  CHECK(keeps());
}
