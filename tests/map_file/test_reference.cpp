// Where the frame of maps lies on the earth.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "common/reference_system/reference_system.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/skip.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Placed {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  std::mt19937_64 random{41};
  std::vector<StoredMap> maps{random_map(1, random), random_map(4, random)};
  model::MapReference first = reference_system::frame_at("EPSG:25832", {401234.5, 5654321.25}, 0.3);
  model::MapReference second = reference_system::frame_at("EPSG:2225", {6048000.0, 2200000.0});

  std::optional<model::MapReference> stated() const {
    return MapFile(file, Access::kRead).reference();
  }
  /// All is as it was put in, and other programs read the same.
  void check_as(const std::vector<StoredMap>& wanted,
                const std::optional<model::MapReference>& reference) const {
    const MapFile opened(file, Access::kRead);
    CHECK(opened.check().empty());
    CHECK(opened.reference() == reference);
    CHECK(opened.maps().size() == wanted.size());
    for (const StoredMap& one : wanted) CHECK(same(opened.read(one.map_id), one));
    const std::string number = reference ? "990001" : "-1";
    const RawFile raw(file);
    for (const char* const table : {"gpkg_contents", "gpkg_geometry_columns"})
      CHECK(raw.rows(fmt::format("SELECT DISTINCT srs_id FROM {} WHERE table_name IN "
                                 "('landmarks', 'trajectory', 'submap_borders', 'loop_closures')",
                                 table)) == number + "|\n");
    // The number in the header of each geometry.
    const std::string header = reference ? "311B0F00" : "FFFFFFFF";
    for (const map_file::Layer& layer : map_file::kLayers)
      CHECK(raw.rows(fmt::format("SELECT count(*) FROM {} WHERE hex(substr(geom, 5, 4)) != '{}'",
                                 layer.table, header)) == "0|\n");
    if (reference)
      CHECK(raw.rows("SELECT definition FROM gpkg_spatial_ref_sys WHERE srs_id = 990001") ==
            reference->definition + "|\n");
  }
};

}  // namespace

TEST_CASE_METHOD(Placed, "maps with a place on the earth are read as they were put in",
                 "[map_file]") {
  map_file::create_map_file(file, maps, note("made"), first);
  check_as(maps, first);
  maps[1] = random_map(4, random);
  CHECK(MapFile(file, Access::kWrite).put({&maps[1], 1}, note("put")) == 2);
  check_as(maps, first);
}

TEST_CASE_METHOD(Placed, "a place on the earth is a change that can be reverted", "[map_file]") {
  map_file::create_map_file(file, maps, note("made"));
  check_as(maps, std::nullopt);
  CHECK(MapFile(file, Access::kWrite).put(first, note("placed")) == 2);
  check_as(maps, first);
  CHECK(MapFile(file, Access::kWrite).put(second, note("elsewhere")) == 3);
  check_as(maps, second);
  for (const auto& [to, reference] :
       std::vector<std::pair<std::uint64_t, std::optional<model::MapReference>>>{
           {2, first}, {1, std::nullopt}, {3, second}, {4, first}}) {
    MapFile(file, Access::kWrite).revert(to, note("back"));
    check_as(maps, reference);
  }
  MapFile(file, Access::kWrite).revert(0, note("to nothing"));
  check_as({}, std::nullopt);
}

TEST_CASE_METHOD(Placed, "files of each older version lie nowhere, and can be placed",
                 "[map_file]") {
  for (StoredMap& one : maps) {
    one.existence.reset();
    for (map_file::StoredLandmark& landmark : one.landmarks) landmark.existence.reset();
  }
  for (int version = 1; version <= 3; ++version) {
    CAPTURE(version);
    std::filesystem::remove(file);
    map_file::create_map_file(file, maps, note("made"));
    make_older(file, version);
    const Bytes bytes = read_bytes(file);
    check_as(maps, std::nullopt);
    CHECK(read_bytes(file) == bytes);
    MapFile(file, Access::kWrite).put(first, note("placed"));
    check_as(maps, first);
    MapFile(file, Access::kWrite).revert(1, note("back"));
    check_as(maps, std::nullopt);
  }
}

TEST_CASE_METHOD(Placed, "a map that another program changed is not placed", "[map_file]") {
  while (maps[0].landmarks.empty()) maps[0] = random_map(1, random);
  map_file::create_map_file(file, maps, note("made"));
  RawFile(file).run("UPDATE landmarks SET times_seen = 77777");
  CHECK(fault_of_work(file, [&] { MapFile(file, Access::kWrite).put(first, note("placed")); }) ==
        Fault::kDamaged);
  CHECK_FALSE(stated());
}

TEST_CASE_METHOD(Placed, "a place that another program changed is found", "[map_file]") {
  map_file::create_map_file(file, maps, note("made"), first);
  const Bytes good = read_bytes(file);
  for (const auto& [change, finding] : std::vector<std::pair<std::string, std::string>>{
           {"UPDATE understory_reference SET longitude_deg = 8", "is not what the history says"},
           {"DELETE FROM understory_reference", "is not what the history says"},
           {"UPDATE gpkg_contents SET srs_id = -1 WHERE table_name = 'landmarks'",
            "is not what the maps state"},
           {"UPDATE gpkg_geometry_columns SET srs_id = 4326", "is not what the maps state"},
           {"UPDATE gpkg_spatial_ref_sys SET definition = 'undefined' WHERE srs_id = 990001",
            "is not what the maps state"}}) {
    CAPTURE(change);
    write_bytes(file, good);
    RawFile(file).run(change);
    std::string all;
    for (const std::string& one : MapFile(file, Access::kRead).check()) all += one + "\n";
    CHECK_THAT(all, Contains(finding));
    // The next change mends what follows from our own rows; revert brings those back.
    MapFile(file, Access::kWrite).revert(1, note("back"));
    check_as(maps, first);
  }
}

TEST_CASE_METHOD(Placed, "ogr2ogr gives the survey's coordinates", "[map_file]") {
  if (std::system("command -v ogr2ogr > /dev/null") != 0)  // NOLINT(cert-env33-c)
    skip("ogr2ogr is not installed (gdal-bin)");
  for (const model::MapReference& reference : {first, second}) {
    std::filesystem::remove(file);
    map_file::create_map_file(file, maps, note("made"), reference);
    const auto table = directory / "landmarks.csv";
    std::filesystem::remove(table);
    const std::string line =
        fmt::format("ogr2ogr -f CSV -lco GEOMETRY=AS_XY -t_srs {} {} {} landmarks",
                    reference.system, table.string(), file.string());
    REQUIRE(std::system(line.c_str()) == 0);  // NOLINT(cert-env33-c)

    const auto into = reference_system::into_frame(reference.system, reference);
    std::ifstream stream(table);
    std::string row;
    std::getline(stream, row);
    std::size_t count = 0;
    for (const StoredMap& map : maps) {
      for (const map_file::StoredLandmark& one : map.landmarks) {
        REQUIRE(std::getline(stream, row));
        double x = 0.0;
        double y = 0.0;
        char comma = 0;
        std::istringstream(row) >> x >> comma >> y;
        CHECK((into.forward({x, y}) - one.landmark.position_m).norm() < 1e-4);
        ++count;
      }
    }
    CHECK(count > 5);
  }
}
