// A disk that is full, or fails, from the N-th call on, for all N.
#include "tests/map_file/failing_disk.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

constexpr long kMostCalls = 2000;

/// No file of a half made one beside it.
bool is_alone(const TemporaryDirectory& directory, std::size_t files) {
  std::size_t found = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory.path()))
    ++found;
  return found == files;
}

/// Fault::kFull for SQLITE_FULL; a failing device is told apart from it.
void check_fault(Fault fault, int code) {
  if (code == SQLITE_FULL) {
    CHECK((fault == Fault::kFull || fault == Fault::kUnreadable));
  } else {
    CHECK(fault == Fault::kUnreadable);
  }
}

void put_on_failing_disk(int code) {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(18);
  const StoredMap first = random_map(1, random, 100);
  const StoredMap second = random_map(1, random, 100);
  map_file::create_map_file(file, {&first, 1}, note("made"));
  const Bytes bytes = read_bytes(file);
  FailingDisk disk;
  long last = 0;
  long refused = 0;
  long read_without_room = 0;

  for (long n = 1; n < kMostCalls && last == 0; ++n) {
    CAPTURE(n, code);
    write_bytes(file, bytes);
    disk.fail_from(n, code);
    bool is_done = false;
    try {
      MapFile opened(file, Access::kWrite);
      opened.put({&second, 1}, note("put"));
      is_done = true;
    } catch (const MapFileError& error) {
      check_fault(error.fault(), code);
      ++refused;
    }
    if (!disk.has_failed()) last = n;
    // It may be read while there is no room; what is read is right.
    try {
      const StoredMap read = MapFile(file, Access::kRead).read(1);
      CHECK((same(read, first) || same(read, second)));
      if (is_done) CHECK(same(read, second));
      ++read_without_room;
    } catch (const MapFileError& error) {
      check_fault(error.fault(), code);
    }
    disk.set_whole();

    const MapFile opened(file, Access::kRead);
    CHECK(opened.check().empty());
    // A change that was reported is there; one that failed may be whole in the log all the same.
    const bool is_there = opened.history().size() == 2;
    if (is_done) CHECK(is_there);
    CHECK(same(opened.read(1), is_there ? second : first));
    CHECK(is_alone(directory, 1));
  }
  REQUIRE(last > 10);
  CHECK(refused > 5);
  WARN(
      fmt::format("code {}: {} writes, syncs and truncations, {} of them ended the change; "
                  "{} times it was read at once",
                  code, last - 1, refused, read_without_room));
}

}  // namespace

TEST_CASE("a full disk at any moment of a change loses nothing", "[map_file]") {
  put_on_failing_disk(SQLITE_FULL);
}

TEST_CASE("a failing disk at any moment of a change loses nothing", "[map_file]") {
  put_on_failing_disk(SQLITE_IOERR_WRITE);
}

TEST_CASE("a full disk while a file is made leaves none", "[map_file]") {
  const TemporaryDirectory directory;
  const auto file = directory / "maps.gpkg";
  std::mt19937_64 random(19);
  const StoredMap map = random_map(1, random, 100);
  FailingDisk disk;
  long last = 0;
  for (long n = 1; n < kMostCalls && last == 0; ++n) {
    CAPTURE(n);
    disk.fail_from(n, SQLITE_FULL);
    try {
      map_file::create_map_file(file, {&map, 1}, note("made"));
      last = n;
    } catch (const MapFileError& error) {
      check_fault(error.fault(), SQLITE_FULL);
      CHECK(std::string(error.what()).starts_with(file.string() + ": "));
      CHECK(is_alone(directory, 0));
    }
    disk.set_whole();
  }
  REQUIRE(last > 10);
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
}
