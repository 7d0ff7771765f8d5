// The store on the bus, with a file and without.
#include <map>

#include "services/submap_store/submap_store.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

struct Folder {
  TemporaryDirectory directory;
  std::mt19937_64 random{6};
  std::filesystem::path file(int number) const {
    return directory.path() / "maps" / fmt::format("drive-{:04}.gpkg", number);
  }
  int files() const {
    int count = 0;
    if (!std::filesystem::exists(directory / "maps")) return 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory / "maps"))
      if (entry.path().extension() == ".gpkg") ++count;
    return count;
  }
};

/// An accepted keyframe.
model::MapUpdate update(std::uint64_t sequence, std::uint32_t map_id,
                        model::MapUpdateStatus status = model::MapUpdateStatus::kUpdated) {
  model::MapUpdate one;
  one.keyframe_sequence = sequence;
  one.utime = static_cast<model::Utime>(1'000'000 * sequence);
  one.map_id = map_id;
  one.status = status;
  one.map_T_vehicle = {static_cast<double>(sequence), 0.0, 0.0};
  one.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  return one;
}

model::MapLandmark landmark(std::uint32_t map_id, std::uint64_t counter, double x_m) {
  model::MapLandmark one;
  one.id = map_file::landmark_id(map_id, counter);
  one.position_m = {x_m, 1.0};
  one.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
  one.observation_count = 3;
  return one;
}

}  // namespace

TEST_CASE_METHOD(Folder, "what is confirmed is on the disk, and comes back", "[submap_store]") {
  std::vector<model::Submap> submaps;
  for (model::SubmapId id = 1; id <= 4; ++id) submaps.push_back(random_submap(1, id, random));
  {
    StoreOnBus store(directory.path());
    for (const model::Submap& one : submaps) store.send("SUBMAP", one);
    store.send("SUBMAP", submaps[1]);
    REQUIRE(store.stored.size() == 5);
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(store.stored[i].id == submaps[i].id);
      CHECK(store.stored[i].content_hash == submaps[i].content_hash);
    }
    store.send("SUBMAP_QUERY", query_for(1, {3, 9, 1}, 5'000'000));
    REQUIRE(store.replies.size() == 2);
    check_same(submaps[2], store.replies[0]);
    check_same(submaps[0], store.replies[1]);
    CHECK(store.replies[0].utime == 5'000'000);
    CHECK(store.shown().empty());
    // Not finished: as if killed.
  }
  StoreOnBus again(directory.path());
  again.send("SUBMAP_QUERY", query_for(1, {2}, 6'000'000));
  REQUIRE(again.replies.size() == 1);
  check_same(submaps[1], again.replies[0]);
  again.send("SUBMAP", submaps[3]);
  CHECK(again.stored.size() == 1);
  again.finish();
  CHECK(files() == 1);
  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  CHECK(opened.read(1).landmarks.size() == 160);
}

TEST_CASE_METHOD(Folder, "a drive without any submap ends as a map, too", "[submap_store]") {
  StoreOnBus store(directory.path());
  store.send("SLAM_UPDATE", update(1, 1, model::MapUpdateStatus::kFirstMap));
  model::MapDelta delta;
  delta.utime = 1'000'000;
  delta.version = 1;
  for (std::uint64_t i = 1; i <= 10; ++i) delta.added.push_back(landmark(1, i, 1.0));
  store.send("MAP_DELTA", delta);
  for (std::uint64_t k = 2; k <= 40; ++k) store.send("SLAM_UPDATE", update(k, 1));
  // Written without being asked to: a computer that loses power loses little.
  CHECK(fault_of_opening(file(1), Access::kRead) == Fault::kInUse);
  delta = {41'000'000,
           0,
           1,
           2,
           {landmark(1, 11, 2.0)},
           {landmark(1, 2, 5.0)},
           {landmark(1, 3, 0.0).id},
           {{landmark(1, 4, 0.0).id, landmark(1, 5, 0.0).id}}};
  store.send("MAP_DELTA", delta);
  CHECK(store.map_requests == 0);
  store.finish();

  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  const StoredMap map = opened.read(1);
  CHECK(map.keyframes.size() == 40);
  REQUIRE(map.landmarks.size() == 9);
  CHECK(map.landmarks[1].landmark.position_m.x() == 5.0);
  CHECK(map.name == "drive-0001");
}

TEST_CASE_METHOD(Folder, "who missed changes asks for the whole map", "[submap_store]") {
  StoreOnBus store(directory.path());
  store.send("SLAM_UPDATE", update(100, 1));
  store.send("SLAM_UPDATE", update(102, 1));
  CHECK(store.map_requests == 1);
  store.send("SLAM_UPDATE", update(104, 1));
  CHECK(store.map_requests == 1);
  store.send("SLAM_UPDATE", update(109, 1));
  CHECK(store.map_requests == 2);

  model::WholeMap whole;
  whole.utime = 110'000'000;
  whole.version = 7;
  whole.landmarks = {landmark(1, 1, 0.0), landmark(1, 2, 1.0)};
  store.send("MAP", whole);
  model::MapDelta delta{111'000'000, 0, 7, 8, {landmark(1, 3, 2.0)}, {}, {}, {}};
  store.send("MAP_DELTA", delta);
  store.send("SLAM_UPDATE", update(116, 1));
  CHECK(store.map_requests == 2);
  delta.base_version = 9;
  delta.version = 10;
  delta.added = {landmark(1, 5, 2.0)};
  store.send("MAP_DELTA", delta);
  store.send("SLAM_UPDATE", update(118, 1));
  CHECK(store.map_requests == 3);
  store.finish();
  CHECK(MapFile(file(1), Access::kRead).read(1).landmarks.size() == 4);
}

TEST_CASE_METHOD(Folder, "a mapper that begins anew begins another file", "[submap_store]") {
  const model::Submap old = random_submap(1, 1, random);
  {
    StoreOnBus store(directory.path());
    store.send("SLAM_UPDATE", update(1, 1, model::MapUpdateStatus::kFirstMap));
    store.send("SUBMAP", old);
    store.send("SLAM_UPDATE", update(10, 1, model::MapUpdateStatus::kFirstMap));
    store.send("SLAM_UPDATE", update(11, 1));
    store.send("SLAM_UPDATE", update(19, 1));
    store.send("SLAM_UPDATE", update(28, 1));
    CHECK(files() == 2);
    // A mapper whose beginning nobody heard: the number is taken, the content is another.
    model::Submap other = random_submap(1, 1, random);
    other.utime = 29'000'000;
    store.send("SUBMAP", other);
    CHECK(files() == 2);
    other = random_submap(1, 1, random);
    other.utime = 30'000'000;
    store.send("SUBMAP", other);
    CHECK(files() == 3);
    CHECK(store.stored.size() == 3);
    store.finish();
  }
  {
    // Hours later.
    StoreOnBus store(directory.path());
    store.send("SLAM_UPDATE", update(40'000, 1));
    store.finish();
    CHECK(files() == 4);
  }
  {
    // Before: another clock.
    StoreOnBus store(directory.path());
    store.send("SLAM_UPDATE", update(5, 1));
    store.finish();
    CHECK(files() == 5);
  }
  for (int number = 1; number <= 5; ++number) {
    CAPTURE(number);
    const MapFile opened(file(number), Access::kRead);
    CHECK(opened.check().empty());
    CHECK(opened.maps().size() == 1);
  }
  CHECK(MapFile(file(1), Access::kRead).read(1).landmarks.size() == 40);
}

TEST_CASE_METHOD(Folder, "all maps of a drive are kept, but those that were given up",
                 "[submap_store]") {
  StoreOnBus store(directory.path());
  const auto begin = [&](std::uint64_t sequence, std::uint32_t map_id) {
    model::MapUpdate first = update(sequence, map_id, model::MapUpdateStatus::kFirstMap);
    first.is_provisional = true;
    store.send("SLAM_UPDATE", first);
    store.send(
        "MAP_DELTA",
        model::MapDelta{first.utime, 0, 0, sequence, {landmark(map_id, 1, 3.0)}, {}, {}, {}});
  };
  begin(1, 1);
  store.send("SLAM_UPDATE", update(2, 1));
  begin(9, 2);
  begin(15, 3);
  store.send("SLAM_UPDATE", update(16, 3));
  store.finish();
  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  REQUIRE(opened.maps().size() == 2);
  CHECK(opened.maps()[0].map_id == 1);
  CHECK(opened.maps()[1].map_id == 3);
  CHECK(opened.read(1).keyframes.size() == 2);
  CHECK(opened.read(3).landmarks.size() == 1);
}

TEST_CASE_METHOD(Folder, "what the existence tracker knows is in the file of the drive",
                 "[submap_store]") {
  StoreOnBus store(directory.path());
  const auto id = [](std::uint64_t counter) { return map_file::landmark_id(1, counter); };
  // Before anything else is known of the map: it waits.
  store.send("EXISTENCE_STATE", existence_state(1, 900'900, {id(1), id(2)}, "early"));
  store.send("SLAM_UPDATE", update(1, 1, model::MapUpdateStatus::kFirstMap));
  model::MapDelta delta;
  delta.utime = 1'000'000;
  delta.version = 1;
  for (std::uint64_t i = 1; i <= 6; ++i) delta.added.push_back(landmark(1, i, 1.0));
  store.send("MAP_DELTA", delta);
  store.send("EXISTENCE_STATE", existence_state(1, 2'000'300, {id(2), id(3), id(4)}, "later"));
  for (std::uint64_t k = 3; k <= 20; ++k) store.send("SLAM_UPDATE", update(k, 1));

  // Written by now. One landmark is another one's, before its last state is written; one is gone.
  store.send("EXISTENCE_STATE", existence_state(1, 20'000'400, {id(4), id(5)}, "merged"));
  store.send("MAP_DELTA", model::MapDelta{21'000'000, 0, 1, 2, {}, {}, {id(3)}, {{id(4), id(5)}}});
  store.send("EXISTENCE_STATE", existence_state(1, 22'000'500, {id(6)}, "end"));
  CHECK(store.shown().empty());
  store.finish();

  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  const StoredMap map = opened.read(1);
  REQUIRE(map.existence);
  CHECK(map.existence->learned == "model end");
  std::map<model::LandmarkId, std::string> states;
  for (const auto& row : map.existence->landmarks) states[row.existence.id] = row.state;
  CHECK(states == std::map<model::LandmarkId, std::string>{
                      {id(1), "early"}, {id(2), "later"}, {id(5), "merged"}, {id(6), "end"}});
  CHECK(map.landmarks[0].existence == 0.9);
  CHECK(map_file::existence_of(opened, 1).front().landmarks.size() == 2);
}

TEST_CASE_METHOD(Folder, "states that no map can have keep nothing else from being stored",
                 "[submap_store]") {
  StoreOnBus store(directory.path());
  store.send("SLAM_UPDATE", update(1, 1, model::MapUpdateStatus::kFirstMap));
  store.send("EXISTENCE_STATE",
             existence_state(1, 1'000'000, {map_file::landmark_id(7, 1)}, "foreign"));
  store.send("EXISTENCE_STATE", existence_state(1, 1'000'000, {map_file::landmark_id(1, 1)}, ""));
  CHECK(store.refused("EXISTENCE_STATE") == 2);
  store.send("MAP_DELTA", model::MapDelta{2'000'000, 0, 0, 1, {landmark(1, 1, 1.0)}, {}, {}, {}});
  store.send("EXISTENCE_STATE",
             existence_state(1, 2'000'000, {map_file::landmark_id(1, 1)}, "good"));
  store.finish();
  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  CHECK(opened.read(1).existence->landmarks.size() == 1);
}

TEST_CASE_METHOD(Folder, "states of a map that was given up go with it", "[submap_store]") {
  StoreOnBus store(directory.path());
  model::MapUpdate first = update(1, 1, model::MapUpdateStatus::kFirstMap);
  first.is_provisional = true;
  store.send("SLAM_UPDATE", first);
  store.send("EXISTENCE_STATE",
             existence_state(1, 2'000'000, {map_file::landmark_id(1, 1)}, "young"));
  store.send("SLAM_UPDATE", update(3, 2, model::MapUpdateStatus::kFirstMap));
  // The tracker has heard of the next map later than the store.
  store.send("EXISTENCE_STATE",
             existence_state(1, 3'000'000, {map_file::landmark_id(1, 1)}, "late"));
  store.send("EXISTENCE_STATE",
             existence_state(2, 4'000'000, {map_file::landmark_id(2, 1)}, "second"));
  store.finish();
  const MapFile opened(file(1), Access::kRead);
  CHECK(opened.check().empty());
  REQUIRE(opened.maps().size() == 1);
  CHECK(opened.maps()[0].map_id == 2);
  // Nobody has told of its landmark.
  CHECK(opened.read(2).existence->landmarks.empty());
}

TEST_CASE("in a replay the same comes out every time", "[submap_store]") {
  std::vector<std::uint8_t> first;
  for (int run = 0; run < 2; ++run) {
    std::mt19937_64 random(7);
    StoreOnBus store("");
    for (model::SubmapId id = 1; id <= 5; ++id) store.send("SUBMAP", random_submap(1, id, random));
    store.send("SUBMAP_QUERY", query_for(1, {2, 3}, 6'000'000));
    store.send("SLAM_UPDATE", update(7, 1));
    store.send("SLAM_UPDATE", update(17, 1));
    store.finish();
    CHECK(store.stored.size() == 5);
    CHECK(store.replies.size() == 2);
    if (run == 0) first = store.said;
    CHECK(store.said == first);
  }
}

TEST_CASE("a state that is saved and loaded writes what the first would have written",
          "[submap_store]") {
  submap_store::SubmapStore store;
  store.take(update(1, 4, model::MapUpdateStatus::kFirstMap));
  store.take(
      model::MapDelta{1'000'000, 0, 0, 1, {landmark(4, 1, 1.0), landmark(4, 2, 2.0)}, {}, {}, {}});
  store.take(update(2, 5, model::MapUpdateStatus::kFirstMap));
  model::LoopClosure closure;
  closure.map_id = 5;
  closure.id = 12;
  store.take(closure);
  store.take(existence_state(5, 2'000'000, {map_file::landmark_id(5, 1)}, "state"));
  submap_store::SubmapStore loaded;
  loaded.load(store.save());
  CHECK(loaded.wants_whole());
  CHECK_FALSE(store.wants_whole());
  for (submap_store::SubmapStore* one : {&store, &loaded}) {
    one->take(model::LoopResult{3'000'000, 0, 5, 12, model::LoopResult::Status::kAccepted, ""});
    const submap_store::Writes due = one->due();
    REQUIRE(due.ground.size() == 2);
    CHECK(due.ground[0].map_id == 4);
    CHECK(due.ground[0].landmarks.size() == 2);
    CHECK(due.ground[1].keyframes.size() == 1);
    REQUIRE(due.closures.size() == 1);
    CHECK(due.closures[0].id == 12);
    REQUIRE(due.existence.size() == 1);
    CHECK(due.existence[0].first == 5);
    CHECK(due.existence[0].second.landmarks[0].state == "state");
    one->written();
    CHECK(one->due().empty());
  }
  CHECK_THROWS(loaded.load("nonsense"));
}
