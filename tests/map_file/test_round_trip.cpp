// Maps in and out.
#include "common/model/program_version.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

TEST_CASE("random maps come back equal to the bit", "[map_file]") {
  const TemporaryDirectory directory;
  std::mt19937_64 random(1);
  for (int run = 0; run < 40; ++run) {
    CAPTURE(run);
    const auto file = directory / fmt::format("{}.gpkg", run);
    std::vector<StoredMap> maps;
    for (std::uint32_t id = 1; id <= 1 + random() % 3; ++id)
      maps.push_back(random_map(id * 7000, random, run == 0 ? 0 : 60));
    map_file::create_map_file(file, maps, note("made"));

    const MapFile opened(file, Access::kRead);
    const auto summaries = opened.maps();
    REQUIRE(summaries.size() == maps.size());
    for (std::size_t i = 0; i < maps.size(); ++i) {
      CHECK(same(opened.read(maps[i].map_id), maps[i]));
      CHECK(summaries[i].trunks + summaries[i].corners == maps[i].landmarks.size());
      CHECK(summaries[i].keyframes == maps[i].keyframes.size());
      CHECK(summaries[i].origin == maps[i].origin);
    }
    CHECK(opened.check().empty());
    REQUIRE(opened.history().size() == 1);
    CHECK(opened.history()[0].note.text == "made");
  }
}

TEST_CASE("a file states which version of the program wrote it last", "[map_file]") {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(3);
  const StoredMap map = random_map(1, random);
  map_file::create_map_file(file, {&map, 1}, note("made"));
  CHECK(MapFile(file, Access::kRead).program_version() == model::program_version());

  // One that an older version made states none until it is written to.
  RawFile(file).run("DELETE FROM understory_meta WHERE key = 'program_version'");
  CHECK(MapFile(file, Access::kRead).program_version().empty());
  CHECK(MapFile(file, Access::kRead).check().empty());
  MapFile(file, Access::kWrite).put({&map, 1}, note("again"));
  CHECK(MapFile(file, Access::kRead).program_version() == model::program_version());
}

TEST_CASE("equal content has equal checksums, another value another one", "[map_file]") {
  const TemporaryDirectory directory;
  std::mt19937_64 random(2);
  StoredMap map = random_map(1, random, 60);
  map.landmarks.push_back(random_landmark(map_file::landmark_id(1, 100'000), random));
  const auto checksum = [&](const std::string& name) {
    map_file::create_map_file(directory / name, {&map, 1}, note(name));
    return MapFile(directory / name, Access::kRead).maps()[0].checksum;
  };

  const std::string first = checksum("a");
  CHECK(first.size() == 64);
  CHECK(checksum("b") == first);
  map.landmarks.back().landmark.position_m.x() =
      std::nextafter(map.landmarks.back().landmark.position_m.x(), 1e9);
  CHECK(checksum("c") != first);
}

TEST_CASE("a map is replaced, others stay as they are", "[map_file]") {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(3);
  const std::vector<StoredMap> maps{random_map(1, random), random_map(2, random)};
  map_file::create_map_file(file, maps, note("two"));
  const StoredMap other = random_map(2, random);
  const StoredMap third = random_map(3, random);
  {
    MapFile opened(file, Access::kWrite);
    CHECK(opened.put(std::vector{other, third}, note("one again, one more")) == 2);
    CHECK(same(opened.read(2), other));
  }

  CHECK(same(MapFile(file, Access::kRead).read(1), maps[0]));
  CHECK(same(MapFile(file, Access::kRead).read(2), other));
  CHECK(same(MapFile(file, Access::kRead).read(3), third));
  CHECK(MapFile(file, Access::kRead).check().empty());
  // At rest it is one file.
  CHECK_FALSE(std::filesystem::exists(file.string() + "-wal"));
  CHECK_FALSE(std::filesystem::exists(file.string() + "-shm"));
}

TEST_CASE("what a map cannot have is refused, and nothing is changed", "[map_file]") {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(4);
  StoredMap good = random_map(1, random);
  good.landmarks = {random_landmark(map_file::landmark_id(1, 1), random),
                    random_landmark(map_file::landmark_id(1, 2), random)};
  good.existence = {
      {5, "model", {{{map_file::landmark_id(1, 2), 0.5, true}, 7, std::string("\0x", 2)}}}};
  good.keyframes = {{1, 2, geometry::SE2(1.0, 2.0, 3.0), Eigen::Matrix3d::Identity()}};
  map_file::create_map_file(file, {&good, 1}, note("good"));
  const std::string before = dump(file);

  const double nan = std::nan("");
  const std::vector<std::function<void(StoredMap&)>> faults{
      [&](StoredMap& map) { map.landmarks[0].landmark.position_m.x() = nan; },
      [](StoredMap& map) { map.landmarks[0].landmark.position_m.y() = 1e300; },
      [](StoredMap& map) { map.landmarks[0].landmark.covariance_m2(0, 0) = -1.0; },
      [](StoredMap& map) { map.landmarks[0].landmark.covariance_m2 << 1, 2, 2, 1; },
      [](StoredMap& map) { map.landmarks[0].landmark.covariance_m2 << 1, 0.1, 0.2, 1; },
      [&](StoredMap& map) { map.landmarks[0].landmark.radius_m = nan; },
      [](StoredMap& map) { map.landmarks[0].landmark.id = 1; },
      [](StoredMap& map) { map.landmarks[0].landmark.id = map_file::landmark_id(1, 0); },
      [](StoredMap& map) { std::swap(map.landmarks[0], map.landmarks[1]); },
      [](StoredMap& map) { map.landmarks[0].existence = 1.1; },
      [](StoredMap& map) {
        map.existence->landmarks[0].existence.id = map_file::landmark_id(1, 3);
      },
      [](StoredMap& map) { map.existence->landmarks[0].existence.probability = -0.1; },
      [&](StoredMap& map) { map.existence->landmarks[0].existence.probability = nan; },
      [](StoredMap& map) { map.existence->landmarks[0].state.clear(); },
      [](StoredMap& map) { map.existence->landmarks.push_back(map.existence->landmarks[0]); },
      [&](StoredMap& map) { map.keyframes[0].covariance(2, 2) = nan; },
      [](StoredMap& map) { map.keyframes[0].keyframe_sequence = ~0ULL; },
      [](StoredMap& map) {
        map.submap_borders = {{1, {{0, 0}, {1, 1}}}};
      },
      [&](StoredMap& map) {
        map.loop_closures = {{1, 2, {nan, 0}, {1, 1}}};
      },
      [](StoredMap& map) { map.map_id = 0; },
      [](StoredMap& map) { map.map_id = map_file::kLastMapId + 1; }};
  for (std::size_t i = 0; i < faults.size(); ++i) {
    CAPTURE(i);
    StoredMap bad = good;
    faults[i](bad);
    MapFile opened(file, Access::kWrite);
    CHECK(fault_of_work(file, [&] { opened.put({&bad, 1}, note("bad")); }) == Fault::kRefused);
    CHECK(opened.history().size() == 1);
    const auto never = directory / "never.gpkg";
    CHECK(fault_of_work(never, [&] {
            map_file::create_map_file(never, {&bad, 1}, note("bad"));
          }) == Fault::kRefused);
    CHECK_FALSE(std::filesystem::exists(never));
  }
  CHECK(dump(file) == before);
  CHECK(fault_of_work(file, [&] { MapFile(file, Access::kRead).read(9); }) == Fault::kRefused);
}

TEST_CASE("a map with a landmark of another map is refused with both numbers", "[map_file]") {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(5);
  StoredMap first = random_map(1, random);
  first.existence.reset();
  first.landmarks = {random_landmark(map_file::landmark_id(1, 1), random)};
  map_file::create_map_file(file, {&first, 1}, note("first"));
  const std::string before = dump(file);

  StoredMap second = random_map(2, random);
  second.existence.reset();
  second.landmarks = {random_landmark(map_file::landmark_id(1, 1), random),
                      random_landmark(map_file::landmark_id(2, 1), random)};
  try {
    MapFile(file, Access::kWrite).put({&second, 1}, note("second"));
    FAIL("stored");
  } catch (const map_file::MapFileError& error) {
    CHECK(error.fault() == Fault::kRefused);
    const std::string text = error.what();
    CHECK_THAT(text, Catch::Matchers::Contains("map 2 is not stored"));
    CHECK_THAT(text, Catch::Matchers::Contains("is in map 1 already"));
  }
  CHECK(dump(file) == before);
  // Where map 1 has it no longer, map 2 may.
  first.landmarks.clear();
  const std::vector<StoredMap> both{first, second};
  MapFile(file, Access::kWrite).put(both, note("both"));
  CHECK(MapFile(file, Access::kRead).read(2).landmarks.size() == 2);
}

TEST_CASE("a new file takes no name that is taken, follows links and leaves nothing",
          "[map_file]") {
  const TemporaryDirectory directory;
  std::mt19937_64 random(5);
  const StoredMap map = random_map(1, random);
  const auto make = [&](const std::filesystem::path& file) {
    map_file::create_map_file(file, {&map, 1}, note("made"));
  };

  const auto taken = directory / "taken";
  write_bytes(taken, {'x'});
  CHECK(fault_of_work(taken, [&] { make(taken); }) == Fault::kRefused);
  CHECK(read_bytes(taken) == Bytes{'x'});
  const auto nowhere = directory.path() / "no folder" / "map.gpkg";
  CHECK(fault_of_work(nowhere, [&] { make(nowhere); }) == Fault::kUnreadable);

  std::filesystem::create_symlink("target.gpkg", directory / "link");
  make(directory / "link");
  CHECK(std::filesystem::is_symlink(directory / "link"));
  CHECK(same(MapFile(directory / "target.gpkg", Access::kRead).read(1), map));
  // A name that SQLite would take for a URI.
  make(directory / "file:a b?mode=memory#%41.gpkg");
  CHECK(same(MapFile(directory / "file:a b?mode=memory#%41.gpkg", Access::kRead).read(1), map));

  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory.path()))
    ++files;
  CHECK(files == 4);
}
