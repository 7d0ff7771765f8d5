// A mapper whose saved state is lost: nobody takes its new map for one of before.
#include <array>
#include <filesystem>
#include <set>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
namespace fs = std::filesystem;

namespace {

/// One life of the mapper, which ends without saving; the keyframer lives as long.
struct MapperLife {
  MapperLife(const fs::path& directory, const std::string& toml)
      : keyframer(keyframer::keyframer_service(), bus, bus::no_clock(), "", "k"),
        mapper(geoslam_mapper::geoslam_mapper_service(), bus, bus::no_clock(), toml, "m"),
        store(directory, "geoslam_mapper") {
    bus.subscribe("SLAM_POSE", 0, [this](const bus::BusMessage& message) {
      poses.push_back(wire::decode_message<model::SlamPose>(message.bytes).value());
    });
    is_recovered = mapper.node().recover(store);
    mapper.node().journal_to(&store);
    keyframer.node().connect();
    mapper.node().connect();
  }
  void drive_on(const sim::Drive& drive, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      bus.publish("LANDMARKS", wire::encode_message(drive.scan(k).scan));
      bus.drain();
    }
  }

  bus::MemoryBus bus;
  bus::HostedService keyframer;
  bus::HostedService mapper;
  bus::StateStore store;
  bool is_recovered = false;
  std::vector<model::SlamPose> poses;
};

sim::Drive short_drive() {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 60.0;
  return {parameters, 22};
}

/// As a file system leaves them that lost its journal.
void empty_all_files(const fs::path& directory) {
  for (const auto& entry : fs::directory_iterator(directory)) fs::resize_file(entry.path(), 0);
}

}  // namespace

TEST_CASE("a map that begins after the state was lost has a new number, and poses count as reset",
          "[mapper]") {
  const sim::Drive drive = short_drive();
  const std::size_t half = drive.size() / 2;
  const std::array<std::size_t, 3> parts{half, half + half / 2, drive.size()};
  const test::Scratch scratch("lost-state");
  std::set<std::uint32_t> numbers;
  std::uint64_t resets = 0;
  {
    MapperLife first(scratch.path(), "[runtime]\nsnapshot_every_events = 3\n");
    first.drive_on(drive, 0, half);
    REQUIRE_FALSE(first.poses.empty());
    for (const auto& pose : first.poses) {
      numbers.insert(pose.map_id);
      resets = std::max(resets, pose.reset_counter);
    }
  }
  CHECK(numbers == std::set<std::uint32_t>{1});
  REQUIRE(fs::exists(scratch.path() / "geoslam_mapper.snapshot"));
  empty_all_files(scratch.path());

  // Two lives without a snapshot: the second one repeats the journal of the first.
  std::uint32_t number = 0;
  for (std::size_t life = 0; life < 2; ++life) {
    MapperLife next(scratch.path(), "");
    CHECK(next.is_recovered);
    next.drive_on(drive, parts[life], parts[life + 1]);
    REQUIRE_FALSE(next.poses.empty());
    for (const auto& pose : next.poses) {
      CHECK(numbers.count(pose.map_id) == 0);
      CHECK(pose.reset_counter > resets);
      CHECK((number == 0 || pose.map_id == number));
      number = pose.map_id;
    }
  }

  // A state that was forgotten on purpose is another drive.
  for (const auto& entry : fs::directory_iterator(scratch.path())) fs::remove(entry.path());
  MapperLife fresh(scratch.path(), "");
  fresh.drive_on(drive, 0, half);
  CHECK(fresh.poses.front().map_id == 1);
}
