// Submaps of a sealed drive, moved by a change of the history.
#include "common/map_file/drive_file.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "tests/submap_store/store_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_file::DriveFile;
using map_file::Placement;

namespace {

/// A drive of three submaps with one closure, sealed.
struct SealedDrive {
  TemporaryDirectory directory;
  std::filesystem::path path = directory / "drive-0001.gpkg";
  std::mt19937_64 random{128};
  std::string before;

  SealedDrive() {
    DriveFile::make(path);
    DriveFile file(path);
    for (model::SubmapId id = 1; id <= 3; ++id) {
      const model::Submap one = random_submap(1, id, random);
      file.put(one, one.map_T_submap);
    }
    file.put(closure(17, 1, 2));
    file.seal();
  }
  static model::LoopClosure closure(std::uint64_t id, model::SubmapId from, model::SubmapId to) {
    model::LoopClosure one;
    one.id = id;
    one.source = "manual";
    one.from.submap = from;
    one.to.submap = to;
    one.from_T_to.mean = {1.0, 2.0, 0.5};
    return one;
  }
  std::string placed() const {
    return dump(path) + dump_of(path, {"understory_submap_poses", "understory_closures"});
  }
  Placement moved() const { return {{{2, {5.0, 6.0, 0.7}}}, {closure(18, 1, 3)}}; }
};

}  // namespace

TEST_CASE_METHOD(SealedDrive, "what moves submaps is one change, and revert puts them back",
                 "[submap_store]") {
  before = placed();
  {
    MapFile file(path, Access::kWrite);
    REQUIRE(file.submaps(1).size() == 3);
    CHECK(file.submaps(9).empty());
    REQUIRE(file.closures(1).size() == 1);
    CHECK(file.put(file.read(1), moved(), note("moved")) == 2);
    CHECK(file.submaps(1)[1].map_T_submap.coordinates() == Eigen::Vector3d(5.0, 6.0, 0.7));
    REQUIRE(file.closures(1).size() == 2);
    CHECK(file.closures(1)[1].to.submap == 3);
    CHECK(file.check().empty());
  }
  const std::string after = placed();
  CHECK((after != before));

  MapFile(path, Access::kWrite).revert(1, note("back"));
  CHECK((placed() == before));
  MapFile(path, Access::kWrite).revert(2, note("forth"));
  CHECK((placed() == after));
  MapFile(path, Access::kWrite).revert(0, note("before the drive"));
  CHECK(MapFile(path, Access::kRead).maps().empty());
  CHECK(MapFile(path, Access::kRead).check().empty());
  // A store begins another file.
  CHECK_FALSE(DriveFile(path).may_go_on());
}

TEST_CASE_METHOD(SealedDrive, "a change that does not fit the submaps is none", "[submap_store]") {
  before = placed();
  const auto fault = [&](const Placement& placement) {
    return fault_of_work(path, [&] {
      MapFile file(path, Access::kWrite);
      file.put(file.read(1), placement, note("moved"));
    });
  };
  Placement unknown = moved();
  unknown.submaps.push_back({77, {}});
  CHECK(fault(unknown) == Fault::kRefused);
  Placement twice = moved();
  twice.closures.push_back(closure(17, 2, 3));
  CHECK(fault(twice) == Fault::kRefused);
  CHECK((placed() == before));
  CHECK(MapFile(path, Access::kRead).history().size() == 1);
}

TEST_CASE_METHOD(SealedDrive, "submaps that somebody else moved since are not put back over",
                 "[submap_store]") {
  {
    MapFile file(path, Access::kWrite);
    file.put(file.read(1), moved(), note("moved"));
  }
  RawFile(path).run("UPDATE understory_submap_poses SET x_m = 99.0 WHERE submap_id = 2");
  before = placed();
  CHECK(fault_of_work(path, [&] { MapFile(path, Access::kWrite).revert(1, note("back")); }) ==
        Fault::kDamaged);
  CHECK((placed() == before));
}

TEST_CASE("a file of before there were submaps has none", "[submap_store]") {
  const TemporaryDirectory directory;
  const auto file = directory / "old.gpkg";
  std::mt19937_64 random(3);
  const StoredMap map = random_map(1, random);
  map_file::create_map_file(file, {&map, 1}, note("made"));
  make_older(file, 1);
  CHECK(MapFile(file, Access::kRead).submaps(1).empty());
  CHECK(MapFile(file, Access::kRead).closures(1).empty());
}
