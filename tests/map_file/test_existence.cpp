// What the existence tracker goes on with: in the file, in its history, and as messages.
#include <set>

#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// Landmarks 1 to `count` of map 1, without states.
StoredMap map_without_states(std::size_t count) {
  std::mt19937_64 random(30);
  StoredMap map;
  for (std::uint64_t i = 1; i <= count; ++i)
    map.landmarks.push_back(random_landmark(map_file::landmark_id(1, i), random));
  return map;
}

map_file::ExistenceRow state_of(std::uint64_t counter, model::Utime utime, const std::string& state,
                                double probability = 0.5) {
  return {{map_file::landmark_id(1, counter), probability, counter % 2 == 0}, utime, state};
}

/// A file in which a map got its states by the second change.
struct WithStates {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "maps.gpkg";
  StoredMap bare = map_without_states(5);
  StoredMap map = bare;
  std::string before;

  WithStates() {
    map_file::create_map_file(file, {&bare, 1}, note("bare"));
    before = dump(file);
    map_file::give_existence(map, {9, "learned", {state_of(2, 7, "two"), state_of(4, 8, "four")}});
    MapFile(file, Access::kWrite).put({&map, 1}, note("with states"));
  }
};

}  // namespace

TEST_CASE_METHOD(WithStates, "a map comes back with its states, and revert takes and brings them",
                 "[map_file]") {
  const StoredMap read = MapFile(file, Access::kRead).read(1);
  CHECK(same(read, map));
  CHECK(read.landmarks[1].existence == 0.5);
  const auto summary = MapFile(file, Access::kRead).maps().front();
  CHECK(summary.existence_states == 2);
  CHECK(summary.not_in_use == 0);

  const std::string with_states = dump(file);
  MapFile(file, Access::kWrite).revert(1, note("back"));
  CHECK(dump(file) == before);
  CHECK_FALSE(MapFile(file, Access::kRead).read(1).existence);
  MapFile(file, Access::kWrite).revert(2, note("forth"));
  CHECK(dump(file) == with_states);
  CHECK(MapFile(file, Access::kRead).check().empty());
}

TEST_CASE_METHOD(WithStates, "states are part of the checksum where there are any", "[map_file]") {
  const auto checksum = [&] { return MapFile(file, Access::kRead).maps().front().checksum; };
  const std::string first = checksum();
  map.existence->landmarks[1].state = "fouR";
  MapFile(file, Access::kWrite).put({&map, 1}, note("another state"));
  CHECK(checksum() != first);
  map.existence.reset();
  MapFile(file, Access::kWrite).put({&map, 1}, note("none"));
  const std::string without = checksum();

  // As a program computed it that had no such tables.
  map_file::create_map_file(directory / "older.gpkg", {&map, 1}, note("none"));
  make_older(directory / "older.gpkg", 2);
  const MapFile older(directory / "older.gpkg", Access::kRead);
  CHECK(older.check().empty());
  CHECK(older.maps().front().checksum == without);
  CHECK(older.maps().front().existence_states == 0);
  CHECK(same(older.read(1), map));
}

TEST_CASE_METHOD(WithStates, "a file of version 2 is read as it is, and takes states when written",
                 "[map_file]") {
  const auto older = directory / "older.gpkg";
  map_file::create_map_file(older, {&bare, 1}, note("bare"));
  make_older(older, 2);
  const Bytes bytes = read_bytes(older);
  CHECK(same(MapFile(older, Access::kRead).read(1), bare));
  CHECK(map_file::existence_of(MapFile(older, Access::kRead), 1).empty());
  CHECK(read_bytes(older) == bytes);

  CHECK(MapFile(older, Access::kWrite).put({&map, 1}, note("with states")) == 2);
  CHECK(MapFile(older, Access::kRead).check().empty());
  CHECK(same(MapFile(older, Access::kRead).read(1), map));
  MapFile(older, Access::kWrite).revert(1, note("back"));
  CHECK(same(MapFile(older, Access::kRead).read(1), bare));
  CHECK(MapFile(older, Access::kRead).check().empty());
}

TEST_CASE_METHOD(WithStates, "check finds states that no map can have", "[map_file]") {
  const Bytes good = read_bytes(file);
  for (const auto& [change, finding] : std::vector<std::pair<std::string, std::string>>{
           {"UPDATE existence_states SET probability = -0.5", "no probability"},
           {"UPDATE existence_states SET state = x''", "its state is empty"},
           {"UPDATE existence_states SET in_use = 2", "in_use is 2"},
           {"DELETE FROM landmarks WHERE landmark_id & 7 = 4", "it is not in the map"},
           {"DELETE FROM existence_models", "without their model"},
           {"UPDATE existence_states SET map_id = 3", "a row of understory_maps"}}) {
    CAPTURE(change);
    write_bytes(file, good);
    RawFile(file).run(change);
    std::string all;
    for (const std::string& one : MapFile(file, Access::kRead).check()) all += one + "\n";
    CHECK_THAT(all, Contains(finding));
    CHECK_THAT(all, Contains("map 1: is not what its checksum says"));
  }
}

TEST_CASE_METHOD(WithStates, "a landmark that QGIS deletes takes its state along", "[map_file]") {
  const std::string with_states = dump(file);
  RawFile(file).run("DELETE FROM landmarks WHERE landmark_id & 7 = 4");
  CHECK(MapFile(file, Access::kWrite).accept(note("felled")) == 3);
  const StoredMap read = MapFile(file, Access::kRead).read(1);
  CHECK(MapFile(file, Access::kRead).check().empty());
  REQUIRE(read.existence->landmarks.size() == 1);
  CHECK(read.existence->landmarks[0] == map.existence->landmarks[0]);
  MapFile(file, Access::kWrite).revert(2, note("back"));
  CHECK(dump(file) == with_states);
}

TEST_CASE("what is stored is told in messages of bounded size", "[map_file]") {
  const TemporaryDirectory directory;
  StoredMap map = map_without_states(450);
  map_file::StoredExistence existence{5, "learned", {}};
  for (std::uint64_t i = 1; i <= 450; ++i) {
    // Two versions of the tracker, and of one of them states of two sizes.
    const std::string state(i <= 210 ? 16 : 17, static_cast<char>('a' + i % 26));
    existence.landmarks.push_back(state_of(i, static_cast<model::Utime>(1000 - i), state));
  }
  map_file::give_existence(map, existence);
  map_file::create_map_file(directory / "maps.gpkg", {&map, 1}, note("made"));

  const MapFile file(directory / "maps.gpkg", Access::kRead);
  const auto messages = map_file::existence_of(file, 1);
  REQUIRE(messages.size() == 4);
  map_file::NewestExistence newest;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    CHECK(messages[i].sequence == i);
    CHECK(messages[i].map_id == 1);
    CHECK(messages[i].model == "learned");
    CHECK(map_file::fault_of(messages[i]).empty());
    newest.take(messages[i]);
  }
  CHECK(messages[0].landmarks.size() == map_file::kStatesTogether);
  CHECK(messages[0].utime == 999);
  CHECK(messages[1].landmarks.size() == 10);
  CHECK(messages[3].landmarks.size() == 40);

  const auto back = newest.stored();
  REQUIRE(back.landmarks.size() == existence.landmarks.size());
  for (std::size_t i = 0; i < back.landmarks.size(); ++i) {
    CHECK(back.landmarks[i].existence == existence.landmarks[i].existence);
    CHECK(back.landmarks[i].state == existence.landmarks[i].state);
  }
}

TEST_CASE("what was learned is told without any landmark", "[map_file]") {
  const auto messages = map_file::messages_of(3, {7, "learned", {}});
  REQUIRE(messages.size() == 1);
  CHECK(messages[0].landmarks.empty());
  CHECK(messages[0].utime == 7);
  CHECK(map_file::fault_of(messages[0]).empty());
}

TEST_CASE("of a landmark's states the newest one counts", "[map_file]") {
  map_file::NewestExistence newest;
  CHECK(newest.empty());
  const auto message = [](model::Utime utime, std::uint64_t counter, const std::string& state) {
    return model::ExistenceState{
        utime, 0, 1, {{map_file::landmark_id(1, counter), 0.5, true}}, "model " + state, state};
  };
  newest.take(message(10, 1, "new"));
  newest.take(message(5, 1, "old"));
  newest.take(message(5, 2, "two"));
  newest.take(message(10, 1, "now"));
  newest.take(message(10, 3, "one"));
  newest.drop(map_file::landmark_id(1, 3));
  const auto stored = newest.stored();
  CHECK(stored.learned == "model one");
  REQUIRE(stored.landmarks.size() == 2);
  CHECK(stored.landmarks[0].state == "now");
  CHECK(stored.landmarks[1].utime == 5);
}

TEST_CASE("a message that is of no map is refused by the landmark", "[map_file]") {
  const model::ExistenceState good{
      1,   0,
      2,   {{map_file::landmark_id(1, 5), 0.5, true}, {map_file::landmark_id(2, 1), 1, true}},
      "m", "abcd"};
  CHECK(map_file::fault_of(good).empty());
  const auto fault = [&](const std::function<void(model::ExistenceState&)>& change) {
    model::ExistenceState bad = good;
    change(bad);
    return map_file::fault_of(bad);
  };
  CHECK_THAT(
      fault([](auto& one) { one.map_id = 1; }),
      Contains(fmt::format("landmark {}: its id is none of map 1", map_file::landmark_id(2, 1))));
  CHECK_THAT(fault([](auto& one) { one.landmarks[0].id = 7; }), Contains("none of map 2"));
  CHECK_THAT(fault([](auto& one) { one.landmarks[1].probability = 2.0; }),
             Contains("no probability"));
  CHECK_THAT(fault([](auto& one) { std::swap(one.landmarks[0], one.landmarks[1]); }),
             Contains("do not ascend"));
  CHECK_THAT(fault([](auto& one) { one.states.clear(); }), Contains("a state of the same size"));
  CHECK_THAT(fault([](auto& one) { one.states = "abc"; }), Contains("a state of the same size"));
}
