// Every state that a file had comes back.
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// A file of changes, with what it was after each of them.
struct ChangedFile {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  std::vector<std::string> states;

  explicit ChangedFile(std::uint64_t seed, int changes = 8) {
    std::mt19937_64 random(seed);
    map_file::create_map_file(file, {}, note("nothing yet"));
    states = {dump(file), dump(file)};
    for (int i = 0; i < changes; ++i) {
      const StoredMap map = random_map(1 + random() % 3, random);
      MapFile(file, Access::kWrite).put({&map, 1}, note("put"));
      states.push_back(dump(file));
    }
  }
};

}  // namespace

TEST_CASE("revert brings back every state, byte for byte, and is a change itself", "[map_file]") {
  ChangedFile changed(6);
  std::mt19937_64 random(7);
  for (int i = 0; i < 12; ++i) {
    const std::uint64_t to = random() % changed.states.size();
    const std::uint64_t number = MapFile(changed.file, Access::kWrite).revert(to, note("back"));
    CAPTURE(to, number);
    CHECK(number == changed.states.size());
    changed.states.push_back(dump(changed.file));
    CHECK(changed.states.back() == changed.states[to]);
    CHECK(MapFile(changed.file, Access::kRead).check().empty());
  }
  const auto history = MapFile(changed.file, Access::kRead).history();
  REQUIRE(history.size() == changed.states.size() - 1);
  CHECK(history.back().number == history.size());
  CHECK(history.back().note.text == "back");
  CHECK(history.back().note.utime == note("").utime);
}

TEST_CASE("a change that is not there is none to go back to", "[map_file]") {
  const ChangedFile changed(8, 2);
  MapFile opened(changed.file, Access::kWrite);
  CHECK(fault_of_work(changed.file, [&] { opened.revert(4, note("back")); }) == Fault::kRefused);
  CHECK(opened.history().size() == 3);
}

TEST_CASE("what another program changed is not reverted over, nor taken for ours", "[map_file]") {
  ChangedFile changed(9, 0);
  std::mt19937_64 random(10);
  StoredMap map = random_map(1, random);
  map.landmarks = {random_landmark(map_file::landmark_id(1, 1), random)};
  MapFile(changed.file, Access::kWrite).put({&map, 1}, note("put"));
  RawFile(changed.file).run("UPDATE landmarks SET times_seen = times_seen + 1");
  const std::string before = dump(changed.file);

  {
    MapFile opened(changed.file, Access::kWrite);
    CHECK(fault_of_work(changed.file, [&] { opened.revert(1, note("back")); }) == Fault::kDamaged);
    CHECK(fault_of_work(changed.file, [&] {
            opened.put({&map, 1}, note("put"));
          }) == Fault::kDamaged);
    CHECK(fault_of_work(changed.file, [&] { opened.read(1); }) == Fault::kDamaged);
    CHECK(opened.check().size() == 1);
    CHECK(opened.history().size() == 2);
  }
  CHECK(dump(changed.file) == before);
}

TEST_CASE("a record of changes that was changed itself is noticed", "[map_file]") {
  const ChangedFile changed(11, 2);
  RawFile(changed.file).run("UPDATE understory_history SET text = 'harmless' WHERE number = 2");
  CHECK(MapFile(changed.file, Access::kRead).check().size() == 1);
  {
    MapFile opened(changed.file, Access::kWrite);
    CHECK(fault_of_work(changed.file, [&] { opened.revert(0, note("back")); }) == Fault::kDamaged);
  }
  RawFile(changed.file).run("DELETE FROM understory_history WHERE number = 2");
  CHECK(MapFile(changed.file, Access::kRead).check().size() == 1);
}
