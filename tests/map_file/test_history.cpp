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

namespace {

/// A map of three landmarks, which another program then changes.
struct EditedFile : ChangedFile {
  StoredMap map;
  std::string edited;

  EditedFile() : ChangedFile(9, 0) {
    std::mt19937_64 random(10);
    map = random_map(1, random);
    map.landmarks.clear();
    for (std::uint64_t i = 1; i <= 3; ++i)
      map.landmarks.push_back(random_landmark(map_file::landmark_id(1, i), random));
    give_random_existence(map, random);
    MapFile(file, Access::kWrite).put({&map, 1}, note("put"));
    states.push_back(dump(file));
    edit(
        "UPDATE landmarks SET times_seen = 17 WHERE landmark_id & 1 = 1; "
        "DELETE FROM landmarks WHERE landmark_id & 2 = 2");
  }
  void edit(const std::string& sql) {
    RawFile(file).run(sql);
    edited = dump(file);
  }
};

}  // namespace

TEST_CASE_METHOD(EditedFile, "what another program changed is not taken for ours", "[map_file]") {
  {
    MapFile opened(file, Access::kWrite);
    CHECK(fault_of_work(file, [&] { opened.put({&map, 1}, note("put")); }) == Fault::kDamaged);
    CHECK(fault_of_work(file, [&] { opened.read(1); }) == Fault::kDamaged);
    CHECK_FALSE(opened.check().empty());
    CHECK(opened.history().size() == 2);
  }
  CHECK(dump(file) == edited);
}

TEST_CASE_METHOD(EditedFile, "what another program changed is reverted, and kept as a change",
                 "[map_file]") {
  CHECK(MapFile(file, Access::kWrite).revert(2, note("back")) == 4);
  CHECK(dump(file) == states[2]);
  CHECK(same(MapFile(file, Access::kRead).read(1), map));
  CHECK(MapFile(file, Access::kRead).check().empty());

  MapFile(file, Access::kWrite).revert(3, note("to the edits"));
  CHECK(MapFile(file, Access::kRead).read(1).landmarks.size() == 1);
  CHECK(MapFile(file, Access::kRead).read(1).landmarks[0].landmark.observation_count == 17);
  MapFile(file, Access::kWrite).revert(1, note("to nothing"));
  CHECK(dump(file) == states[1]);
  CHECK(MapFile(file, Access::kRead).check().empty());
}

TEST_CASE_METHOD(EditedFile, "what another program changed is accepted as a change", "[map_file]") {
  CHECK(MapFile(file, Access::kWrite).accept(note("edited by hand")) == 3);
  CHECK(MapFile(file, Access::kRead).check().empty());
  CHECK(MapFile(file, Access::kRead).read(1).landmarks.size() == 1);
  {
    MapFile opened(file, Access::kWrite);
    CHECK(fault_of_work(file, [&] { opened.accept(note("again")); }) == Fault::kRefused);
  }
  MapFile(file, Access::kWrite).revert(2, note("back"));
  CHECK(dump(file) == states[2]);
}

TEST_CASE_METHOD(EditedFile, "what is no map any more is reverted and not accepted", "[map_file]") {
  for (const char* const sql :
       {"UPDATE landmarks SET covariance_xx_m2 = -1", "UPDATE landmarks SET kind = 'house'",
        "DELETE FROM landmarks; DELETE FROM trajectory; DELETE FROM submap_borders; "
        "DELETE FROM loop_closures; DELETE FROM understory_maps",
        "UPDATE existence_states SET probability = 1.5"}) {
    CAPTURE(sql);
    edit(sql);
    CHECK_FALSE(MapFile(file, Access::kRead).check().empty());
    if (edited.find("house") != std::string::npos || edited.find("|-1.0|") != std::string::npos ||
        edited.find("|1.5|") != std::string::npos) {
      MapFile opened(file, Access::kWrite);
      CHECK(fault_of_work(file, [&] { opened.accept(note("edited")); }) == Fault::kDamaged);
    }
    MapFile(file, Access::kWrite).revert(2, note("back"));
    CHECK(dump(file) == states[2]);
    CHECK(MapFile(file, Access::kRead).check().empty());
  }
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
