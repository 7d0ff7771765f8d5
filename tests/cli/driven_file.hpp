// A file that mapper and store leave of a drive round a ring.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/bus/device.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/submap_store/adapter.hpp"
#include "tests/loop_closer/ring_drive.hpp"
#include "tests/map_file/map_fixture.hpp"

namespace understory::test {

/// Drives it, and seals the file in `folder`.
inline std::filesystem::path driven_file(const RingDrive& drive,
                                         const std::filesystem::path& folder) {
  bus::MemoryBus bus(bus::MemoryBus::Queues::kUnlimited, [](const bus::BusMessage& /*one*/) {});
  std::vector<std::unique_ptr<bus::HostedService>> hosted;
  const auto host = [&](const bus::Service& service, const std::string& toml) -> auto& {
    hosted.push_back(std::make_unique<bus::HostedService>(service, bus, bus::no_clock(), toml,
                                                          service.name + ".toml"));
    return *hosted.back();
  };
  host(geoslam_mapper::geoslam_mapper_service(),
       "[smoothing]\nuse_odometry = true\nlost_sigma_m = 100.0\n"
       "lost_sigma_rad = 3.0\ncondense_m = 10.0\nhand_over_m = 60.0\n")
      .node()
      .connect();
  auto& store = host(submap_store::submap_store_service(), "");
  auto& device = dynamic_cast<bus::Device&>(store.adapter());
  device.set_state_directory(folder);
  device.open();
  store.node().connect();

  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (k > 0) bus.publish("ODOMETRY", wire::encode_message(drive.odometry_to(k)));
    bus.publish("KEYFRAME", wire::encode_message(drive.keyframe_at(k)));
    bus.drain();
  }
  for (auto& one : hosted) {
    one->adapter().finish();
    bus.drain();
  }
  return folder / "maps" / "drive-0001.gpkg";
}

/// Mean error of the keyframes in the map [m]; its frame is that of the first one.
inline double mean_error_m(const RingDrive& drive, const std::filesystem::path& file) {
  const StoredMap map = MapFile(file, Access::kRead).read(1);
  REQUIRE_FALSE(map.keyframes.empty());
  double sum = 0.0;
  for (const model::KeyframePose& one : map.keyframes)
    sum +=
        (one.map_T_vehicle.translation() - drive.truth(one.keyframe_sequence).translation()).norm();
  return sum / static_cast<double>(map.keyframes.size());
}

/// The keyframe of a submap that is nearest to its origin, by its sequence.
inline std::uint64_t middle_of(const model::Submap& submap) {
  return std::ranges::min_element(
             submap.keyframes, {},
             [](const auto& one) { return one.map_T_vehicle.translation().norm(); })
      ->keyframe_sequence;
}

/// All of a file that a closure changes.
inline std::string dump_placed(const std::filesystem::path& file) {
  return dump(file) + dump_of(file, {"understory_submap_poses", "understory_closures"});
}

}  // namespace understory::test
