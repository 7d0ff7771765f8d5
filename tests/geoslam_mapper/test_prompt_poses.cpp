// When poses are told: at once, or not at all.
#include <memory>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

/// A pose, and the newest scan when it came.
struct HeardPose {
  model::Utime utime = 0;
  model::Utime newest_scan = 0;
};

std::vector<HeardPose> drive_through(const sim::Drive& drive, const std::string& mapper_toml) {
  bus::MemoryBus bus;
  std::vector<HeardPose> poses;
  model::Utime newest_scan = 0;
  bus.subscribe("SLAM_POSE", 0, [&](const bus::BusMessage& message) {
    const auto pose = wire::decode_message<model::SlamPose>(message.bytes);
    poses.push_back({pose.value().utime, newest_scan});
  });
  bus::HostedService keyframer(keyframer::keyframer_service(), bus, bus::no_clock(), "", "k");
  bus::HostedService mapper(geoslam_mapper::geoslam_mapper_service(), bus, bus::no_clock(),
                            mapper_toml, "m");
  keyframer.node().connect();
  mapper.node().connect();
  for (std::size_t k = 0; k < drive.size(); ++k) {
    newest_scan = drive.utime(k);
    bus.publish("LANDMARKS", wire::encode_message(drive.scan(k).scan));
    bus.drain();
  }
  return poses;
}

sim::Drive fast_scans() {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 20.0;
  parameters.speed_mps = 2.0;  // A scan every 0.1 s.
  return {parameters, 21};
}

}  // namespace

TEST_CASE("No pose is told when it is the past", "[mapper]") {
  const sim::Drive drive = fast_scans();
  REQUIRE(drive.utime(1) - drive.utime(0) <= 110'000);
  const auto prompt = drive_through(drive, "");
  for (const HeardPose& pose : prompt) CHECK(pose.newest_scan - pose.utime <= 50'000);

  // The first keyframe's scans but the last one wait in vain; all others have one.
  CHECK(prompt.size() >= drive.size() - 10);
  const auto all = drive_through(drive, "[output]\noldest_pose_s = 60.0\n");
  CHECK(all.size() > prompt.size());
  CHECK(all.back().utime == prompt.back().utime);
}
