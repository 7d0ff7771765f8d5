// The file as other programs see it.
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/map_file/map_fixture.hpp"
#include "tests/skip.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Package {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  StoredMap map;

  Package() {
    std::mt19937_64 random(20);
    map = random_map(1, random, 60);
    map.landmarks = {random_landmark(map_file::landmark_id(1, 7), random),
                     random_landmark(map_file::landmark_id(1, 9), random)};
    map.existence.reset();
    map_file::create_map_file(file, {&map, 1}, note("made"));
  }

  /// What a program of GDAL prints.
  std::string ogrinfo(const std::string& arguments) const {
    if (std::system("command -v ogrinfo > /dev/null") != 0)  // NOLINT(cert-env33-c)
      skip("ogrinfo is not installed (gdal-bin)");
    const auto out = directory / "ogrinfo.txt";
    const std::string line =
        fmt::format("ogrinfo {} {} > {} 2>&1", file.string(), arguments, out.string());
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    std::ifstream stream(out);
    const std::string text{std::istreambuf_iterator<char>(stream),
                           std::istreambuf_iterator<char>()};
    CAPTURE(line, text);
    CHECK(status == 0);
    CHECK_THAT(text, !Contains("Warning") && !Contains("ERROR"));
    return text;
  }
};

}  // namespace

TEST_CASE_METHOD(Package, "the file is a GeoPackage by its own tables", "[map_file]") {
  const RawFile raw(file);
  CHECK(raw.rows("PRAGMA application_id") == fmt::format("{}|\n", 0x47504B47));
  CHECK(raw.rows("PRAGMA user_version") == "10300|\n");
  CHECK(raw.rows("PRAGMA journal_mode") == "delete|\n");
  CHECK(raw.rows("SELECT srs_id, organization FROM gpkg_spatial_ref_sys ORDER BY 1") ==
        "-1|NONE|\n0|NONE|\n4326|EPSG|\n");
  CHECK(raw.rows("SELECT table_name, geometry_type_name, srs_id FROM gpkg_geometry_columns "
                 "ORDER BY 1") ==
        "landmarks|POINT|-1|\nloop_closures|LINESTRING|-1|\nsubmap_borders|POLYGON|-1|\n"
        "trajectory|POINT|-1|\n");
  CHECK(raw.rows("SELECT count(*) FROM gpkg_contents AS c LEFT JOIN sqlite_schema AS s "
                 "ON s.name = c.table_name WHERE s.name IS NULL") == "0|\n");
  CHECK(raw.rows("SELECT count(*) FROM gpkg_extensions WHERE extension_name = "
                 "'gpkg_rtree_index' AND scope = 'write-only'") == "4|\n");
  // The header of a geometry: GP, version 0, little endian without envelope, SRS -1.
  CHECK(raw.rows("SELECT count(*) FROM landmarks WHERE hex(substr(geom, 1, 8)) = "
                 "'47500001FFFFFFFF' AND length(geom) = 29") == "2|\n");
}

TEST_CASE_METHOD(Package, "ogrinfo lists the layers and counts their features", "[map_file]") {
  const std::string text = ogrinfo("-so -al");
  const auto layer = [&](const std::string& name, const std::string& kind, std::size_t count) {
    const std::size_t begin = text.find("Layer name: " + name + "\n");
    REQUIRE(begin != std::string::npos);
    const std::string part = text.substr(begin, text.find("Layer name: ", begin + 1) - begin);
    CHECK_THAT(part, Contains("Geometry: " + kind + "\n") &&
                         Contains(fmt::format("Feature Count: {}\n", count)) &&
                         Contains("Undefined Cartesian"));
    return part;
  };

  CHECK_THAT(layer("landmarks", "Point", 2), Contains("FID Column = landmark_id") &&
                                                 Contains("diameter_m: Real") &&
                                                 Contains("times_seen: Integer64"));
  layer("trajectory", "Point", map.keyframes.size());
  layer("submap_borders", "Polygon", map.submap_borders.size());
  layer("loop_closures", "Line String", map.loop_closures.size());
  CHECK_THAT(text, Contains("Layer name: understory_maps") && !Contains("understory_history"));

  const Eigen::Vector2d at = map.landmarks[0].landmark.position_m;
  const std::string near = ogrinfo(fmt::format("landmarks -spat {} {} {} {}", at.x() - 0.1,
                                               at.y() - 0.1, at.x() + 0.1, at.y() + 0.1));
  CHECK_THAT(near,
             Contains(fmt::format("OGRFeature(landmarks):{}\n", map.landmarks[0].landmark.id)));
  // Looking at it changes nothing and leaves nothing beside it.
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK_FALSE(std::filesystem::exists(file.string() + "-wal"));
}

TEST_CASE_METHOD(Package, "what GDAL changes is noticed, and the index follows", "[map_file]") {
  ogrinfo(fmt::format("-q -sql \"DELETE FROM landmarks WHERE landmark_id = {}\"",
                      map.landmarks[0].landmark.id));
  const auto findings = MapFile(file, Access::kRead).check();
  REQUIRE(findings.size() == 1);
  CHECK_THAT(findings[0], Contains("map 1") && Contains("changed by another program"));
}
