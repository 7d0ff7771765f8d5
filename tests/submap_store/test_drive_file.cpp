// A drive's file: what goes in, what the layers show, and how it enters the history.
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "common/map_file/drive_file.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/skip.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_file::DriveFile;
using map_file::Keeping;

namespace {

struct Drive {
  TemporaryDirectory directory;
  std::filesystem::path path = directory / "drive-0001.gpkg";
  std::mt19937_64 random{5};
  Drive() { DriveFile::make(path); }
};

/// Where a submap's landmarks must be.
void check_shown(const StoredMap& map, const model::Submap& submap, const geometry::SE2& pose) {
  std::size_t found = 0;
  for (const map_file::StoredLandmark& one : map.landmarks) {
    if (one.submap_id != submap.id) continue;
    const auto& was = submap.landmarks.at(found++);
    CHECK(one.landmark.id == was.id);
    CHECK((one.landmark.position_m - pose * was.position_m).norm() < 2e-4);
  }
  CHECK(found == submap.landmarks.size());
  for (const auto& was : submap.keyframes) {
    const auto at = std::ranges::find(map.keyframes, was.utime, &model::KeyframePose::utime);
    REQUIRE(at != map.keyframes.end());
    CHECK((at->map_T_vehicle.translation() - (pose * was.map_T_vehicle).translation()).norm() <
          1e-9);
  }
  const auto border =
      std::ranges::find(map.submap_borders, submap.id, &map_file::SubmapBorder::submap_id);
  REQUIRE(border != map.submap_borders.end());
}

}  // namespace

TEST_CASE_METHOD(Drive, "a drive ends as a map file with one change", "[submap_store]") {
  std::vector<model::Submap> submaps;
  for (model::SubmapId id = 1; id <= 5; ++id) submaps.push_back(random_submap(1, id, random));
  {
    DriveFile file(path);
    for (const model::Submap& one : submaps) {
      CHECK(file.put(one, one.map_T_submap) == Keeping::kNew);
      CHECK(file.put(one, one.map_T_submap) == Keeping::kAlready);
    }
    model::Submap other = submaps[2];
    other.content_hash ^= 1U;
    CHECK(file.put(other, other.map_T_submap) == Keeping::kOther);
    check_same(submaps[2], file.get({1, 3}).value());
    CHECK_FALSE(file.get({1, 6}));
    CHECK_FALSE(file.get({2, 3}));
    CHECK(fault_of_opening(path, Access::kRead) == Fault::kInUse);
    file.seal();
    CHECK(file.may_go_on());
  }
  const MapFile opened(path, Access::kRead);
  CHECK(opened.check().empty());
  CHECK(opened.history().size() == 1);
  const StoredMap map = opened.read(1);
  CHECK(map.landmarks.size() == 200);
  CHECK(map.keyframes.size() == 25);
  for (const model::Submap& one : submaps) check_shown(map, one, one.map_T_submap);
}

TEST_CASE_METHOD(Drive, "a correction moves submaps, some now, all when it is sealed",
                 "[submap_store]") {
  model::MapCorrection correction{9'000'000, 0, 1, 2, {}};
  std::vector<model::Submap> submaps;
  {
    DriveFile file(path);
    for (model::SubmapId id = 1; id <= 30; ++id) {
      submaps.push_back(random_submap(1, id, random, 10));
      file.put(submaps.back(), submaps.back().map_T_submap);
      correction.submaps.push_back({id, {100.0 - static_cast<double>(id), 3.0, 0.3}});
    }
    file.put(correction);
    model::MapCorrection old = correction;
    old.version = 1;
    for (auto& one : old.submaps) one.map_T_submap = {0.0, 0.0, 0.0};
    file.put(old);
    CHECK(file.get({1, 4})->map_T_submap.coordinates() ==
          correction.submaps[3].map_T_submap.coordinates());
    CHECK(file.draw(12) == 12);
    CHECK(file.draw(12) == 12);
    CHECK(file.draw(12) == 6);
    CHECK(file.draw(12) == 0);
    correction.version = 3;
    for (auto& one : correction.submaps) one.map_T_submap = {5.0, static_cast<double>(one.id), 0.0};
    file.put(correction);
    file.seal();
    CHECK(file.draw(12) == 0);
  }
  const MapFile opened(path, Access::kRead);
  CHECK(opened.check().empty());
  CHECK(opened.history().size() == 1);
  const StoredMap map = opened.read(1);
  for (std::size_t i = 0; i < submaps.size(); ++i)
    check_shown(map, submaps[i], correction.submaps[i].map_T_submap);
}

TEST_CASE_METHOD(Drive, "who opens a file that was left open seals it", "[submap_store]") {
  const model::Submap first = random_submap(1, 1, random);
  const model::Submap second = random_submap(1, 2, random);
  {
    DriveFile file(path);
    file.put(first, first.map_T_submap);
    file.put(model::MapCorrection{3'000'000, 0, 1, 1, {{1, {50.0, 60.0, 1.0}}}});
  }
  {
    const MapFile opened(path, Access::kRead);
    CHECK(opened.check().empty());
    REQUIRE(opened.history().size() == 1);
    CHECK(opened.history()[0].note.utime == 3'000'000);
    check_shown(opened.read(1), first, {50.0, 60.0, 1.0});
  }
  {
    // A store goes on in it, and it is sealed by who writes next.
    DriveFile file(path);
    CHECK(file.may_go_on());
    CHECK(file.put(first, first.map_T_submap) == Keeping::kAlready);
    CHECK(file.put(second, second.map_T_submap) == Keeping::kNew);
  }
  {
    MapFile opened(path, Access::kWrite);
    CHECK(opened.history().size() == 2);
    check_shown(opened.read(1), second, second.map_T_submap);
    opened.revert(1, note("back"));
    CHECK(opened.check().empty());
    CHECK(opened.read(1).landmarks.size() == 40);
  }
  // Its submaps are not those of its map any more.
  CHECK_FALSE(DriveFile(path).may_go_on());
}

TEST_CASE_METHOD(Drive, "a submap that came back is where the mapper says", "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  model::MapLandmark moved = submap.landmarks[3];
  moved.position_m = {7.0, 8.0};
  {
    DriveFile file(path);
    file.put(submap, submap.map_T_submap);
    map_file::GroundChange change{1, 2'000'000, {moved}, {submap.landmarks[4].id}, {}, false};
    CHECK(file.put(change) == 0);
    file.put(model::MapCorrection{3'000'000, 0, 1, 1, {{1, {50.0, 60.0, 1.0}}}});
    file.seal();
  }
  {
    const StoredMap map = MapFile(path, Access::kRead).read(1);
    REQUIRE(map.landmarks.size() == submap.landmarks.size() - 1);
    CHECK(map.landmarks[3].landmark.position_m == Eigen::Vector2d(7.0, 8.0));
    CHECK_FALSE(map.landmarks[3].submap_id);
    CHECK((map.landmarks[0].landmark.position_m -
           submap.map_T_submap * submap.landmarks[0].position_m)
              .norm() < 2e-4);
  }

  // It is handed over again, without one of its landmarks.
  model::Submap again = submap;
  again.id = 2;
  again.replaced = {1};
  again.landmarks.erase(again.landmarks.begin() + 4);
  again.landmarks.pop_back();
  {
    DriveFile file(path);
    CHECK(file.put(again, {1.0, 2.0, 0.5}) == Keeping::kNew);
    CHECK_FALSE(file.get({1, 1}));
    CHECK(file.put(submap, submap.map_T_submap) == Keeping::kAlready);
    check_same(again, file.get({1, 2}).value());
  }
  const MapFile opened(path, Access::kRead);
  CHECK(opened.check().empty());
  const StoredMap map = opened.read(1);
  CHECK(map.landmarks.size() == again.landmarks.size());
  CHECK(map.submap_borders.size() == 1);
  check_shown(map, again, {1.0, 2.0, 0.5});
}

TEST_CASE_METHOD(Drive, "the ground is what the mapper holds", "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  const model::Submap other = random_submap(1, 2, random);
  {
    DriveFile file(path);
    file.put(map_file::GroundChange{1, 1'000'000, other.landmarks, {}, other.keyframes, false});
    file.put(submap, submap.map_T_submap);
    // All of it; what is not in it is gone, but for submaps.
    map_file::GroundChange whole{1, 2'000'000, {other.landmarks[0]}, {}, {}, true};
    model::MapLandmark wrong = other.landmarks[1];
    wrong.radius_m = -1.0;
    whole.landmarks.push_back(wrong);
    CHECK(file.put(whole) == 1);
    file.drop(7);
    file.put(map_file::GroundChange{2, 2'000'000, {}, {}, {}, true});
    file.drop(2);
    CHECK(file.highest_map() == 1);
  }
  const MapFile opened(path, Access::kRead);
  CHECK(opened.check().empty());
  const StoredMap map = opened.read(1);
  REQUIRE(map.landmarks.size() == submap.landmarks.size() + 2);
  CHECK(map.landmarks[submap.landmarks.size()].landmark.id == other.landmarks[0].id);
  CHECK(map.keyframes.size() == 10);
}

TEST_CASE_METHOD(Drive, "closures are drawn between their ends, wherever those go",
                 "[submap_store]") {
  const model::Submap a = random_submap(1, 1, random);
  const model::Submap b = random_submap(1, 2, random);
  model::LoopClosure closure;
  closure.id = 4'000'000'000'000'000'000;
  closure.source = "manual";
  closure.from = {1, 0};
  closure.to = {0, b.keyframes[2].keyframe_sequence};
  {
    DriveFile file(path);
    file.put(a, a.map_T_submap);
    file.put(closure);
    closure.id = 5;
    file.put(closure);
    file.put(b, b.map_T_submap);
    file.put(model::MapCorrection{9'000'000, 0, 1, 1, {{1, {-7.0, -8.0, 1.0}}}});
    file.take_back(1, 5);
    file.take_back(1, 6);
    file.seal();
  }
  const MapFile opened(path, Access::kRead);
  CHECK(opened.check().empty());
  const StoredMap map = opened.read(1);
  REQUIRE(map.loop_closures.size() == 1);
  CHECK(map.loop_closures[0].from_m == Eigen::Vector2d(-7.0, -8.0));
  CHECK(map.loop_closures[0].to_sequence == b.keyframes[2].keyframe_sequence);
  CHECK((map.loop_closures[0].to_m - (b.map_T_submap * b.keyframes[2].map_T_vehicle).translation())
            .norm() < 1e-9);
}

TEST_CASE_METHOD(Drive, "ogrinfo lists the layers of a drive, with the features where they are",
                 "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  {
    DriveFile file(path);
    file.put(submap, submap.map_T_submap);
    file.put(model::MapCorrection{3'000'000, 0, 1, 1, {{1, {5000.0, 60.0, 1.0}}}});
    file.seal();
  }
  if (std::system("command -v ogrinfo > /dev/null") != 0)  // NOLINT(cert-env33-c)
    skip("ogrinfo is not installed (gdal-bin)");
  const auto out = directory / "ogrinfo.txt";
  const std::string line = fmt::format("ogrinfo -so -al {} -spat 4900 -40 5100 160 > {} 2>&1",
                                       path.string(), out.string());
  CHECK(std::system(line.c_str()) == 0);  // NOLINT(cert-env33-c)
  std::ifstream stream(out);
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  using Catch::Matchers::Contains;
  CHECK_THAT(text, !Contains("Warning") && !Contains("ERROR"));
  for (const std::string layer : {"landmarks", "trajectory", "submap_borders", "loop_closures"})
    CHECK_THAT(text, Contains("Layer name: " + layer + "\n"));
  CHECK_THAT(text, Contains("Feature Count: 40\n") && Contains("Feature Count: 5\n") &&
                       Contains("Feature Count: 1\n"));
  CHECK_THAT(text, !Contains("Layer name: understory_submaps"));
}

TEST_CASE_METHOD(Drive, "states of existence are kept, the newest of each landmark",
                 "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  const auto id = [&](std::size_t i) { return submap.landmarks[i].id; };
  {
    DriveFile file(path);
    // Of a map that the file has not: nothing.
    file.put(existence_state(1, 100, {id(0)}, "none"));
    CHECK(file.highest_map() == 0);
    file.put(submap, submap.map_T_submap);
    file.put(existence_state(1, 2'000'101, {id(0), id(1), id(2)}, "first"));
    file.put(existence_state(1, 3'000'202, {id(1), id(2)}, "second"));
    file.put(existence_state(1, 1'000'303, {id(2), id(3)}, "older"));
    file.put(existence_state(1, 3'000'202, {id(1), id(2)}, "second"));
    file.seal();
  }
  {
    const MapFile opened(path, Access::kRead);
    CHECK(opened.check().empty());
    CHECK(opened.history().size() == 1);
    const StoredMap map = opened.read(1);
    REQUIRE(map.existence);
    CHECK(map.existence->learned == "model second");
    REQUIRE(map.existence->landmarks.size() == 4);
    CHECK(map.existence->landmarks[0].state == "first");
    CHECK(map.existence->landmarks[1].state == "second");
    CHECK(map.existence->landmarks[2].utime == 3'000'202);
    CHECK(map.existence->landmarks[3].state == "older");
    CHECK(map.landmarks[0].existence == 0.101);
    CHECK(map.landmarks[2].existence == 0.202);
    CHECK_FALSE(map.landmarks[4].existence);
  }
  const std::string sealed = dump_of_maps(path);
  {
    // On it goes: corrected, drawn anew, and a state more. It is a change of its own.
    DriveFile file(path);
    file.put(model::MapCorrection{4'000'000, 0, 1, 1, {{1, {50.0, 60.0, 1.0}}}});
    file.put(existence_state(1, 5'000'404, {id(5)}, "third"));
  }
  MapFile opened(path, Access::kWrite);
  CHECK(opened.check().empty());
  CHECK(opened.history().size() == 2);
  CHECK(opened.read(1).existence->landmarks.size() == 5);
  CHECK(opened.read(1).landmarks[0].existence == 0.101);
  opened.revert(1, note("back"));
  CHECK(opened.check().empty());
  CHECK(opened.read(1).existence->landmarks.size() == 4);
}

TEST_CASE_METHOD(Drive, "states follow their landmarks", "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  const auto id = [&](std::size_t i) { return submap.landmarks[i].id; };
  model::Submap again = submap;
  again.id = 2;
  again.replaced = {1};
  again.landmarks.erase(again.landmarks.begin() + 4);
  {
    DriveFile file(path);
    file.put(submap, submap.map_T_submap);
    file.put(existence_state(1, 2'000'500, {id(0), id(1), id(2), id(4)}, "state"));
    // One is gone, one goes over to another map, one is not handed over again.
    file.put(map_file::GroundChange{1, 3'000'000, {submap.landmarks[1]}, {}, {}, false});
    file.put(again, again.map_T_submap);
    file.put(map_file::GroundChange{1, 3'000'000, {}, {id(1)}, {}, false});
    file.put(map_file::GroundChange{2, 4'000'000, {submap.landmarks[2]}, {}, {}, false});
  }
  const MapFile opened(path, Access::kRead);
  const auto findings = opened.check();
  CAPTURE(findings);
  CHECK(findings.empty());
  const StoredMap first = opened.read(1);
  REQUIRE(first.existence->landmarks.size() == 1);
  CHECK(first.existence->landmarks[0].existence.id == id(0));
  CHECK(first.landmarks[0].existence == 0.5);
  const StoredMap second = opened.read(2);
  REQUIRE(second.existence);
  CHECK(second.existence->learned == "model state");
  REQUIRE(second.existence->landmarks.size() == 1);
  CHECK(second.existence->landmarks[0].existence.id == id(2));
}

TEST_CASE_METHOD(Drive, "states that no map can have are refused by name", "[submap_store]") {
  const model::Submap submap = random_submap(1, 1, random);
  {
    DriveFile file(path);
    file.put(submap, submap.map_T_submap);
    const auto foreign = existence_state(1, 2'000'000, {map_file::landmark_id(2, 1)}, "state");
    const auto empty = existence_state(1, 2'000'000, {submap.landmarks[0].id}, "");
    for (const auto& wrong : {foreign, empty})
      CHECK(fault_of_work(path, [&] { file.put(wrong); }) == Fault::kRefused);
    CHECK_THROWS_WITH(file.put(foreign),
                      Catch::Matchers::Contains(
                          "existence of landmark 562949953421313: its id is none of map 1"));
  }
  CHECK_FALSE(MapFile(path, Access::kRead).read(1).existence);
}
