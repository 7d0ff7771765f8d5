// Maps of surveys in world coordinates, and maps of drives that are placed on the earth.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <random>

#include "common/io/lcm_log.hpp"
#include "common/reference_system/reference_system.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/command_folder.hpp"
#include "understory/gnss_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
using reference_system::Transformation;

namespace {

/// A plot of stems, known by its places on the earth.
struct Plot : CommandFolder {
  std::mt19937_64 random{71};
  model::MapReference truth = reference_system::frame_at("EPSG:4326", {10.0071, 51.4432}, 0.0);
  std::vector<Eigen::Vector2d> stems_m;  ///< In that frame.
  std::string map = path("plot.gpkg");

  Plot() {
    std::uniform_real_distribution<double> side(-90.0, 90.0);
    while (stems_m.size() < 80) {
      const double x = side(random);
      const Eigen::Vector2d at(x, side(random));
      const auto is_close = [&](const auto& other) { return (other - at).norm() < 3.0; };
      if (std::ranges::none_of(stems_m, is_close)) stems_m.push_back(at);
    }
  }

  std::string path(const std::string& name) const { return (directory / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    write_bytes(directory / name, Bytes(text.begin(), text.end()));
    return path(name);
  }
  /// The stems in a reference system, which shares its datum with the plot's, or nearly.
  std::string survey(const std::string& name, const std::string& system,
                     const std::string& heading) const {
    const Transformation into(system, truth.definition,
                              reference_system::Geographic{51.4432, 10.0071});
    std::string text = heading + ",dbh_m\n";
    for (const Eigen::Vector2d& stem : stems_m) {
      const Eigen::Vector2d at = into.inverse(stem);
      text += heading.starts_with("lat") ? fmt::format("{:.10f},{:.10f},0.3\n", at.y(), at.x())
                                         : fmt::format("{:.4f},{:.4f},0.3\n", at.x(), at.y());
    }
    return write(name, text);
  }
  /// The stems in metres of a frame that nothing places.
  void local_map(const std::string& file, const geometry::SE2& map_T_plot) const {
    std::string text = "x_m,y_m\n";
    for (const Eigen::Vector2d& stem : stems_m) {
      const Eigen::Vector2d at = map_T_plot * stem;
      text += fmt::format("{:.4f},{:.4f}\n", at.x(), at.y());
    }
    fine("map import " + write("local.csv", text) + " --out " + file);
  }
  /// Farthest distance of a landmark of the map from its stem on the earth [m].
  double off_m(const std::string& file, std::uint32_t map_id = 1) const {
    const MapFile opened(file, Access::kRead);
    const Transformation into(opened.reference().value().definition, truth.definition,
                              reference_system::Geographic{51.4432, 10.0071});
    const StoredMap stored = opened.read(map_id);
    REQUIRE(stored.landmarks.size() == stems_m.size());
    double worst_m = 0.0;
    for (std::size_t i = 0; i < stems_m.size(); ++i)
      worst_m = std::max(
          worst_m, (into.forward(stored.landmarks[i].landmark.position_m) - stems_m[i]).norm());
    return worst_m;
  }
  std::string check(const std::string& file) const { return fine("map check " + file); }
};

nlohmann::json layer_in(const std::filesystem::path& file) {
  return nlohmann::json::parse(read_text(file));
}

}  // namespace

TEST_CASE_METHOD(Plot, "surveys of every system lie where they were surveyed, near 0", "[cli]") {
  // The last ones are of other datums: the plot is known in them to a metre or two.
  for (const auto& [system, heading, most_m] :
       std::vector<std::tuple<std::string, std::string, double>>{
           {"EPSG:32632", "easting,northing", 5e-4},
           {"EPSG:32633", "x_m,y_m", 5e-4},
           {"EPSG:4326", "lat,lon", 5e-4},
           {"EPSG:25832", "east,north", 5e-4},
           {"EPSG:3035", "x,y", 5e-4},
           {"EPSG:4258", "latitude,longitude", 5e-4},
           {"EPSG:31467", "Rechtswert,Hochwert", 5e-4}}) {
    CAPTURE(system);
    std::filesystem::remove(map);
    fine("map import " + survey("s.csv", system, heading) + " --crs " + system + " --out " + map);
    check(map);
    CHECK(off_m(map) < most_m);
    const MapFile opened(map, Access::kRead);
    CHECK(opened.reference()->system == system);
    for (const map_file::StoredLandmark& one : opened.read(1).landmarks)
      CHECK(one.landmark.position_m.norm() < 300.0);
  }
}

TEST_CASE_METHOD(Plot, "a further table goes into the frame of the file's maps", "[cli]") {
  fine("map import " + survey("a.csv", "EPSG:32632", "east,north") + " --crs EPSG:32632 --out " +
       map);
  const auto frame = MapFile(map, Access::kRead).reference();
  fine("map import " + survey("b.csv", "EPSG:32633", "east,north") + " --crs EPSG:32633 --out " +
       map);
  fine("map import " + survey("c.csv", "EPSG:4326", "lat,lon") + " --crs EPSG:4326 --out " + map);
  check(map);
  CHECK(MapFile(map, Access::kRead).reference() == frame);
  for (std::uint32_t id = 1; id <= 3; ++id) CHECK(off_m(map, id) < 5e-4);

  const std::string local = write("local.csv", "x_m,y_m\n1,2\n");
  refused("map import " + local + " --out " + map, 1, "is georeferenced (EPSG:32632): --crs");
  fine("map import " + local + " --same-frame --out " + map);
  refused("map import " + path("a.csv") + " --crs EPSG:32632 --origin 1,2 --out " + map, 2,
          "--origin");
  fine("map import " + local + " --out " + path("other.gpkg"));
  refused("map import " + path("a.csv") + " --crs EPSG:32632 --out " + path("other.gpkg"), 1,
          "is not georeferenced");
}

TEST_CASE_METHOD(Plot, "an origin that is said is the map's", "[cli]") {
  const std::string text = "east,north\n401234.567,5654321.001\n401334.567,5654321.001\n";
  fine("map import " + write("s.csv", text) +
       " --crs EPSG:25832 --origin 401234.567,5654321.001 --out " + map);
  const StoredMap stored = MapFile(map, Access::kRead).read(1);
  CHECK(stored.landmarks[0].landmark.position_m.norm() < 1e-4);
  // 100 m of the grid at 401 km are 100.03 m.
  CHECK(stored.landmarks[1].landmark.position_m.norm() == Approx(100.028).margin(0.001));

  std::filesystem::remove(map);
  fine("map import " + write("d.csv", "lat,lon\n51.0,7.5\n") +
       " --crs EPSG:4326 --origin 51.0,7.5 --out " + map);
  CHECK(MapFile(map, Access::kRead).read(1).landmarks[0].landmark.position_m.norm() < 1e-4);
  refused("map import " + path("s.csv") + " --crs EPSG:25832 --origin 7,51 --out " + path("x.gpkg"),
          1, "line 2");
}

TEST_CASE_METHOD(Plot, "systems and tables that do not go together are refused by name", "[cli]") {
  const std::string table = survey("s.csv", "EPSG:32632", "easting,northing");
  for (const auto& [system, why] : std::vector<std::pair<std::string, std::string>>{
           {"EPSG:99999", "no reference system of this name is known"},
           {"32632", "write EPSG:32632"},
           {"EPSG:4978", "is geocentric"},
           {"EPSG:7837", "is a system of heights"},
           {"EPSG:4326", "the reference system has degrees"}}) {
    refused("map import " + table + " --crs " + system + " --out " + map, 1, why);
    CHECK_FALSE(std::filesystem::exists(map));
  }
  refused("map import " + survey("d.csv", "EPSG:4326", "lat,lon") + " --out " + map, 1,
          "--crs EPSG:4326");
  // Columns the wrong way round, as far as that shows.
  const std::string swapped =
      "map import " + write("w.csv", "y,x\n401234,5654321\n") + " --crs EPSG:25832 --out " + map;
  refused(swapped, 1, "km outside of the area of EPSG:25832");
  CHECK_FALSE(std::filesystem::exists(map));
  CHECK_THAT(run(swapped + " --force").error, Contains("are the columns swapped"));
  CHECK(std::filesystem::exists(map));
  // A zone is used beside its area: a remark alone.
  const Outcome beside = run("map import " + write("b.csv", "x,y\n740600,5766000\n") +
                             " --crs EPSG:25832 --out " + path("beside.gpkg"));
  CHECK(beside.status == 0);
  CHECK_THAT(beside.error, Contains("km outside of the area of EPSG:25832"));
}

TEST_CASE_METHOD(Plot, "maps of two systems are merged by their landmarks", "[cli]") {
  const std::string other = path("other.gpkg");
  fine("map import " + survey("a.csv", "EPSG:32632", "east,north") + " --crs EPSG:32632 --out " +
       map);
  fine("map import " + survey("b.csv", "EPSG:32633", "east,north") +
       " --crs EPSG:32633 --origin 83000,5711000 --out " + other);
  const auto frame = MapFile(map, Access::kRead).reference();
  const Outcome outcome = run("map merge " + map + " " + other + " --into " + map);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.error, !Contains("apart"));
  check(map);
  CHECK(MapFile(map, Access::kRead).reference() == frame);
  CHECK(off_m(map) < 0.01);
  CHECK_THAT(run("map diff " + map + " " + other).error, Contains("are georeferenced differently"));
  fine("map revert " + map + " --to 1");
  check(map);
  CHECK(MapFile(map, Access::kRead).reference() == frame);

  // One that is placed wrongly shows where the landmarks are the same.
  const std::string placed = "map georeference " + other + " --like " + map + " --replace";
  refused(placed, 1, "its landmarks do not show the frame of " + map);
  fine(placed + " --force");
  CHECK_THAT(run("map merge " + map + " " + other).error, Contains("apart by their georeferences"));
  local_map(path("local.gpkg"), geometry::SE2(20.0, 30.0, 0.5));
  CHECK_THAT(run("map merge " + path("local.gpkg") + " " + map).error,
             Contains("is not taken over"));
}

TEST_CASE_METHOD(Plot, "control points georeference a map, and revert takes it back", "[cli]") {
  const geometry::SE2 map_T_plot(120.0, -40.0, 2.2);
  local_map(map, map_T_plot);
  const Transformation into("EPSG:32632", truth.definition);
  std::string points = "landmark_id,map_x_m,map_y_m,easting,northing\n";
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d world = into.inverse(stems_m[i]);
    const Eigen::Vector2d at = map_T_plot * stems_m[i];
    points += i < 2 ? fmt::format("{},,", map_file::landmark_id(1, i + 1))
                    : fmt::format(",{:.4f},{:.4f}", at.x(), at.y());
    points += fmt::format(",{:.4f},{:.4f}\n", world.x(), world.y());
  }
  const std::string table = write("points.csv", points);
  const std::string command =
      "map georeference " + map + " --crs EPSG:32632 --control-points " + table;
  CHECK_THAT(fine(command + " --dry-run"), Contains("4 points") && Contains("nothing was written"));
  CHECK_FALSE(MapFile(map, Access::kRead).reference());
  CHECK_THAT(fine(command), Contains("degrees to the left of east") && Contains("(change 2)"));
  check(map);
  CHECK(off_m(map) < 0.005);
  CHECK_THAT(fine("map info " + map), Contains("EPSG:32632"));
  CHECK(nlohmann::json::parse(fine("map info --json " + map))["reference"]["system"] ==
        "EPSG:32632");
  refused(command, 1, "is georeferenced already");
  fine("map revert " + map + " --to 1");
  CHECK_FALSE(MapFile(map, Access::kRead).reference());
  check(map);

  // Swapped columns are elsewhere; they mirror the points, so no map fits.
  const std::string swapped = "map georeference " + map + " --crs EPSG:32632 --control-points " +
                              write("swapped.csv",
                                    "map_x_m,map_y_m,north,east\n0,0,600000,5700000\n"
                                    "100,0,600100,5700000\n0,50,600000,5700050\n");
  refused(swapped, 1, "km outside of the area of EPSG:32632");
  const Outcome forced = run(swapped + " --force");
  CHECK(forced.status == 1);
  CHECK_THAT(forced.error, Contains("not placed"));
  CHECK_FALSE(MapFile(map, Access::kRead).reference());
  refused("map georeference " + map + " --crs EPSG:32632 --control-points " +
              write("one.csv", "map_x_m,map_y_m,east,north\n0,0,600000,5700000\n"),
          1, "two or more");
  refused("map georeference " + map + " --crs EPSG:32632 --control-points " +
              write("none.csv", "landmark_id,east,north\n77,600000,5700000\n"),
          1, "line 2: no landmark 77");
  refused("map georeference " + map, 2, "one of --control-points, --fixes, --like");
  refused("map georeference " + map + " --fixes none.lcm --force", 2, "--force is of --like");
}

TEST_CASE_METHOD(Plot, "fixes of a drive georeference its map", "[cli]") {
  // A drive round the plot in a frame of its own, and the fixes of an antenna on it.
  const geometry::SE2 map_T_plot(7.0, 3.0, -1.1);
  const Eigen::Vector2d antenna_m(0.8, -0.3);
  const Transformation earth = reference_system::to_wgs84(truth);
  std::normal_distribution<double> noise(0.0, 2.0);
  StoredMap driven;
  io::LcmLogWriter log(path("drive.lcm"));
  for (int i = 0; i < 400; ++i) {
    const auto pose_at = [](double step) {
      const double angle = 0.02 * step;
      return geometry::SE2(80.0 * std::cos(angle), 60.0 * std::sin(angle), angle + 1.5);
    };
    const geometry::SE2 pose = pose_at(i);
    const model::Utime utime = 1'000'000LL * (i + 1);
    driven.keyframes.push_back({static_cast<std::uint64_t>(i), utime + 300'000,
                                map_T_plot * pose_at(i + 0.3), 0.01 * Eigen::Matrix3d::Identity()});
    const double dx = noise(random);
    const Eigen::Vector2d at_deg =
        earth.forward(pose * antenna_m + Eigen::Vector2d(dx, noise(random)));
    gnss_t fix{};
    fix.utime = utime;
    fix.valid = 1;
    fix.sigma_m = 2.0;
    fix.has_geodetic = 1;
    fix.longitude_deg = at_deg.x();
    fix.latitude_deg = at_deg.y();
    log.write(utime, "RAW_GNSS", wire::encode_message(fix));
  }
  log.commit();
  for (std::size_t i = 0; i < stems_m.size(); ++i) {
    map_file::StoredLandmark one;
    one.landmark.id = map_file::landmark_id(1, i + 1);
    one.landmark.position_m = map_T_plot * stems_m[i];
    driven.landmarks.push_back(one);
  }
  map_file::create_map_file(map, {&driven, 1}, note("a drive"));

  const std::string command = "map georeference " + map + " --fixes " + path("drive.lcm");
  CHECK_THAT(fine(command + " --antenna-m 0.8,-0.3"), Contains("399 points"));
  check(map);
  // 400 fixes of 2 m each show the origin to 0.1 m and the heading to 1.4 mrad: 0.18 m at 130 m.
  CHECK(off_m(map) < 0.7);
  const auto info = nlohmann::json::parse(fine("map info --json " + map));
  CHECK(info["reference"]["system"] == "EPSG:4326");
  refused(command + " --replace --most-rms-m 0.1", 1, "not placed");

  // The log of another drive has no fix of these times.
  for (model::KeyframePose& pose : driven.keyframes) pose.utime += 1'000'000'000;
  map_file::create_map_file(path("other.gpkg"), {&driven, 1}, note("another"));
  refused("map georeference " + path("other.gpkg") + " --fixes " + path("drive.lcm"), 1,
          "is it the log of another drive?");
}

TEST_CASE_METHOD(Plot, "GeoJSON is longitude and latitude of WGS 84", "[cli]") {
  fine("map import " + survey("a.csv", "EPSG:32632", "east,north") + " --crs EPSG:32632 --out " +
       map);
  fine("map export " + map + " --out " + path("out"));
  const auto layer = layer_in(directory / "out" / "map-1" / "landmarks.geojson");
  CHECK(layer["type"] == "FeatureCollection");
  CHECK_FALSE(layer.contains("crs"));
  REQUIRE(layer["features"].size() == stems_m.size());
  const Transformation earth = reference_system::to_wgs84(truth);
  for (std::size_t i = 0; i < stems_m.size(); ++i) {
    const auto& feature = layer["features"][i];
    const Eigen::Vector2d at_deg = earth.forward(stems_m[i]);
    // 0.1 mm of the table, 0.1 mm of nine decimals.
    CHECK(std::abs(feature["geometry"]["coordinates"][0].get<double>() - at_deg.x()) < 4e-9);
    CHECK(std::abs(feature["geometry"]["coordinates"][1].get<double>() - at_deg.y()) < 4e-9);
    CHECK(feature["properties"]["diameter_m"] == 0.3);
  }

  local_map(path("local.gpkg"), {});
  refused("map export " + path("local.gpkg") + " --format geojson --out " + path("none"), 1,
          "the map is not georeferenced: `understory map georeference`");
  CHECK_FALSE(std::filesystem::exists(path("none")));
  fine("map export " + path("local.gpkg") + " --out " + path("csv"));
  CHECK(std::filesystem::exists(directory / "csv" / "map-1" / "landmarks.csv"));
  CHECK_FALSE(std::filesystem::exists(directory / "csv" / "map-1" / "landmarks.geojson"));
}

TEST_CASE_METHOD(CommandFolder,
                 "a map across the date line is one map, and is cut there in GeoJSON", "[cli]") {
  const auto path = [&](const std::string& name) { return (directory / name).string(); };
  const std::string map = path("taveuni.gpkg");
  std::ofstream(path("stems.csv")) << "lat,lon\n-16.8,179.99\n-16.8,-179.99\n-16.801,180.001\n";
  fine("map import " + path("stems.csv") + " --crs EPSG:4326 --out " + map);
  StoredMap stored = MapFile(map, Access::kRead).read(1);
  // 0.02 degrees at this latitude.
  CHECK((stored.landmarks[1].landmark.position_m - stored.landmarks[0].landmark.position_m).x() ==
        Approx(2132.0).margin(5.0));

  // A square of 200 m, and a loop, over the line.
  stored.submap_borders = {{1, {{-100, -100}, {100, -100}, {100, 100}, {-100, 100}}}};
  stored.loop_closures.emplace_back();
  stored.loop_closures.back().from_m = {-500.0, 0.0};
  stored.loop_closures.back().to_m = {500.0, 0.0};
  map_file::MapFile(map, Access::kWrite).put(std::vector<StoredMap>{stored}, note("borders"));
  fine("map export " + map + " --format geojson --out " + path("out"));
  const std::filesystem::path out = directory / "out" / "map-1";
  std::vector<double> longitudes;
  const nlohmann::json landmarks = layer_in(out / "landmarks.geojson");
  for (const auto& feature : landmarks["features"])
    longitudes.push_back(feature["geometry"]["coordinates"][0].get<double>());
  CHECK(longitudes[0] == Approx(179.99).margin(1e-6));
  CHECK(longitudes[1] == Approx(-179.99).margin(1e-6));
  CHECK(longitudes[2] == Approx(-179.999).margin(1e-6));

  const auto border = layer_in(out / "submap_borders.geojson")["features"][0]["geometry"];
  CHECK(border["type"] == "MultiPolygon");
  REQUIRE(border["coordinates"].size() == 2);
  for (const auto& part : border["coordinates"]) {
    const auto& ring = part[0];
    REQUIRE(ring.size() == 5);
    CHECK(ring.front() == ring.back());
    double area_deg2 = 0.0;
    for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
      const double x = ring[i][0];
      const double next_x = ring[i + 1][0];
      CHECK(std::abs(next_x - x) < 0.01);
      area_deg2 += 0.5 * (x * ring[i + 1][1].get<double>() - next_x * ring[i][1].get<double>());
    }
    CHECK(area_deg2 > 0.0);  // Counter-clockwise, as RFC 7946 wants outer rings.
  }
  const auto loop = layer_in(out / "loop_closures.geojson")["features"][0]["geometry"];
  CHECK(loop["type"] == "MultiLineString");
  REQUIRE(loop["coordinates"].size() == 2);
  CHECK(loop["coordinates"][0][1][0] == 180.0);
  CHECK(loop["coordinates"][1][0][0] == -180.0);
  CHECK(loop["coordinates"][0][1][1] == loop["coordinates"][1][0][1]);
}

TEST_CASE_METHOD(Plot, "a drive in a survey of seven digits is located as in one near 0", "[cli]") {
  const std::string config = " --config " UNDERSTORY_SOURCE_CONFIG;
  fine("sim intermediate --length 40 --seed 5 --out " + path("drive.lcm"));
  fine("replay " + path("drive.lcm") + config + " --out " + path("mapped.lcm"));
  fine("export " + path("mapped.lcm") + " --format csv --out " + path("csv"));

  // The map of the drive as a table, near 0 and in UTM, turned against the grid.
  std::string near = "x_m,y_m\n";
  std::string world = "easting,northing\n";
  const auto frame = reference_system::frame_at("EPSG:25832", {401234.0, 5654321.0}, 0.0);
  const Transformation into = reference_system::into_frame("EPSG:25832", frame);
  fine("map import " + path("mapped.lcm") + " --out " + path("drive.gpkg"));
  for (const auto& one : MapFile(path("drive.gpkg"), Access::kRead).read(1).landmarks) {
    const Eigen::Vector2d at = one.landmark.position_m;
    const Eigen::Vector2d on_earth = into.inverse(at);
    near += fmt::format("{:.4f},{:.4f}\n", at.x(), at.y());
    world += fmt::format("{:.4f},{:.4f}\n", on_earth.x(), on_earth.y());
  }
  fine("map import " + write("near.csv", near) + " --out " + path("near.gpkg"));
  fine("map import " + write("world.csv", world) + " --crs EPSG:25832 --out " + map);

  const auto poses_of = [&](const std::string& file) {
    fine("replay " + path("drive.lcm") + config + " --localisation-only --map " + file + " --out " +
         path("again.lcm"));
    fine("export " + path("again.lcm") + " --format tum --out " + path("tum"));
    return read_text(directory / "tum" / "live.tum");
  };
  const std::string in_near = poses_of(path("near.gpkg"));
  const std::string in_world = poses_of(map);
  CHECK(lines(in_near) > 50);
  CHECK(lines(in_world) == lines(in_near));
  fine("export " + path("again.lcm") + " --format geojson --frame-of " + map + " --out " +
       path("places"));
  const auto layer = layer_in(directory / "places" / "landmarks.geojson");
  CHECK(layer["features"][0]["geometry"]["coordinates"][1].get<double>() ==
        Approx(51.03).margin(0.02));
  refused("export " + path("again.lcm") + " --format geojson --out " + path("no"), 1,
          "--frame-of MAP.gpkg");

  // The drive's own map, and one of elsewhere that is in its frame by chance as little as any.
  const std::string drive = path("again.gpkg");
  fine("map import " + path("again.lcm") + " --out " + drive);
  fine("map georeference " + drive + " --like " + map);
  CHECK(MapFile(drive, Access::kRead).reference() == MapFile(map, Access::kRead).reference());
  const std::string elsewhere = path("elsewhere.gpkg");
  fine("map import " + survey("plot.csv", "EPSG:25832", "east,north") + " --crs EPSG:25832 --out " +
       elsewhere);
  refused("map georeference " + drive + " --replace --like " + elsewhere, 1,
          "its landmarks do not show the frame of " + elsewhere + ": ");
  const std::string geojson =
      "export " + path("again.lcm") + " --format geojson --frame-of " + elsewhere + " --out ";
  refused(geojson + path("no"), 1, "did the drive begin with that map?");
  CHECK_FALSE(std::filesystem::exists(path("no")));
  fine(geojson + path("forced") + " --force");
}
