// Bits turned over.
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

struct DamagedFile {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  std::string content;
  Bytes bytes;
  std::size_t found = 0;

  DamagedFile() {
    std::mt19937_64 random(13);
    const std::vector<StoredMap> maps{random_map(1, random, 200), random_map(2, random, 200)};
    map_file::create_map_file(file, maps, note("made"));
    const StoredMap again = random_map(2, random, 200);
    MapFile(file, Access::kWrite).put({&again, 1}, note("again"));
    content = dump_of_maps(file);
    bytes = read_bytes(file);
  }

  /// It is noticed when the file is opened or checked, or it is in nothing that belongs to a map:
  /// room that is not used, the description of a reference system.
  void turn_over(std::size_t at, unsigned bit) {
    Bytes damaged = bytes;
    damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ (1U << bit));
    write_bytes(file, damaged);
    CAPTURE(at, bit);
    if (is_noticed()) {
      ++found;
    } else {
      CHECK((dump_of_maps(file) == content));
    }
  }

  bool is_noticed() {
    try {
      return !MapFile(file, Access::kRead).check().empty();
    } catch (const MapFileError& error) {
      const std::string line = error.what();
      CAPTURE(line);
      CHECK(line.find("maps.gpkg") != std::string::npos);
      CHECK(line.find('\n') == std::string::npos);
      return true;
    }
  }
};

}  // namespace

TEST_CASE_METHOD(DamagedFile, "a bit that is turned over is found, or affects no map",
                 "[map_file]") {
  std::mt19937_64 random(14);
  for (int i = 0; i < 400; ++i) turn_over(random() % bytes.size(), random() % 8);
  WARN(fmt::format("{} of 400 turned bits found in {} bytes", found, bytes.size()));
  CHECK(found > 100);
}

TEST_CASE_METHOD(DamagedFile, "a bit of every 31st byte", "[.long]") {
  std::mt19937_64 random(15);
  std::size_t turned = 0;
  for (std::size_t at = 0; at < bytes.size(); at += 31, ++turned) turn_over(at, random() % 8);
  WARN(fmt::format("{} of {} turned bits found", found, turned));
}

TEST_CASE_METHOD(DamagedFile, "a file that was cut is noticed", "[map_file]") {
  for (std::size_t size = bytes.size() - 1; size > 0; size -= std::min<std::size_t>(size, 3001)) {
    CAPTURE(size);
    write_bytes(file, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    CHECK(is_noticed());
  }
}

TEST_CASE_METHOD(DamagedFile, "a last page that was cut is noticed when the file is opened",
                 "[map_file]") {
  std::mt19937_64 random(16);
  constexpr std::size_t kPage = 4096;
  for (int i = 0; i < 50; ++i) {
    const std::size_t size = bytes.size() - 1 - random() % (kPage - 1);
    CAPTURE(size);
    write_bytes(file, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    CHECK(fault_of_opening(file, Access::kRead) == Fault::kDamaged);
    CHECK(fault_of_opening(file, Access::kWrite) == Fault::kDamaged);
    CHECK(std::filesystem::file_size(file) == size);
  }
}

TEST_CASE_METHOD(DamagedFile, "an index that lacks a feature is noticed", "[map_file]") {
  RawFile(file).run(
      "DELETE FROM rtree_trajectory_geom WHERE id = (SELECT min(fid) FROM trajectory)");
  CHECK(is_noticed());
}

TEST_CASE_METHOD(DamagedFile, "values of another type are noticed", "[map_file]") {
  for (const char* const change :
       {"UPDATE trajectory SET heading_rad = 'north' WHERE fid = (SELECT min(fid) FROM trajectory)",
        "UPDATE landmarks SET kind = 'house'", "UPDATE landmarks SET geom = x'00'",
        "UPDATE understory_maps SET map_id = 40000 WHERE map_id = 2",
        "UPDATE gpkg_contents SET max_x = 0", "DELETE FROM gpkg_geometry_columns",
        "DELETE FROM gpkg_extensions", "UPDATE understory_maps SET checksum = ''"}) {
    CAPTURE(change);
    write_bytes(file, bytes);
    RawFile(file).run(change);
    CHECK(is_noticed());
  }
}
