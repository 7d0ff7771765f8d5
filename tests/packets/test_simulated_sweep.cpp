// A sweep of the simulator, sent as an Ouster's packets, is the sweep that the simulator publishes
// as RAW_SWEEP: the same frame, direction of rotation, order of rings and times.
#include <cmath>
#include <numbers>
#include <random>

#include "sim/spinning_lidar.hpp"
#include "tests/catch.hpp"
#include "tests/packets/byte_writer.hpp"
#include "tests/packets/made_up_sensor.hpp"

using namespace understory;
using namespace understory::test;
using Message = std::vector<std::uint8_t>;

namespace {

constexpr std::size_t kColumns = 1024;
constexpr std::size_t kColumnsPerPacket = 16;

sim::World trunks(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-30.0, 30.0);
  sim::World world;
  for (int i = 0; i < 60; ++i)
    world.add_trunk(sim::ObjectClass::kTrunk, {place(random), place(random)}, 0.3, 15.0);
  return world;
}

packets::OusterMetadata metadata_of(const sim::LidarParameters& lidar) {
  packets::OusterMetadata metadata;
  metadata.profile = packets::ouster_profile("RNG19_RFL8_SIG16_NIR16").value();
  metadata.product_line = "OS-1-32";
  metadata.columns_per_frame = kColumns;
  metadata.last_column = kColumns - 1;
  // Ouster counts beams downwards.
  metadata.altitude_rad.assign(lidar.elevations_rad.rbegin(), lidar.elevations_rad.rend());
  metadata.azimuth_rad.assign(lidar.elevations_rad.size(), 0.0);
  // The lidar frame is turned round in the sensor's, as in every Ouster.
  metadata.sensor_T_lidar.linear() = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  return metadata;
}

/// A frame, and the first packet of the next one.
std::vector<Message> packets_of(const model::PointSweep& sweep, std::int64_t start_ns,
                                std::mt19937_64& random) {
  const std::size_t beams = sweep.rings;
  std::vector<std::uint32_t> range_mm(kColumns * beams, 0);
  std::vector<std::uint8_t> intensity(kColumns * beams, 0);
  for (const model::SweepPoint& point : sweep.points) {
    const auto column = static_cast<std::size_t>(std::lround(point.time_s * 10.0 * kColumns));
    const std::size_t pixel = column * beams + (beams - 1 - point.ring);
    range_mm.at(pixel) = static_cast<std::uint32_t>(std::lround(1e3F * point.position().norm()));
    intensity.at(pixel) = point.intensity;
  }

  const std::size_t column_bytes = 12 + 12 * beams;
  std::vector<Message> packets;
  for (std::size_t first = 0; first <= kColumns; first += kColumnsPerPacket) {
    ByteWriter packet(64 + kColumnsPerPacket * column_bytes, random);
    packet.put<std::uint16_t>(0, 1);
    packet.put<std::uint16_t>(2, first < kColumns ? 7 : 8);
    for (std::size_t c = 0; c < kColumnsPerPacket; ++c) {
      const std::size_t at = 32 + c * column_bytes;
      const std::size_t column = (first + c) % kColumns;
      packet.put(at, start_ns + std::llround(1e8 / kColumns * static_cast<double>(first + c)));
      packet.put(at + 8, static_cast<std::uint16_t>(column));
      packet.put<std::uint16_t>(at + 10, 1);
      for (std::size_t beam = 0; beam < beams; ++beam) {
        packet.put_bits(at + 12 + 12 * beam, range_mm[column * beams + beam], 0x7FFFF);
        packet.put(at + 16 + 12 * beam, intensity[column * beams + beam]);
      }
    }
    packets.push_back(packet.take());
  }
  return packets;
}

}  // namespace

TEST_CASE("a simulated sweep comes through an Ouster's packets as it was", "[packets]") {
  std::mt19937_64 random(1);
  const sim::World world = trunks(random);
  sim::LidarParameters lidar;
  lidar.columns = kColumns;
  sim::SpinningLidar laser(world, lidar, 1);
  Eigen::Isometry3d world_T_vehicle = Eigen::Isometry3d::Identity();
  world_T_vehicle.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const model::PointSweep raw = laser.sweep_stationary(world_T_vehicle).raw;
  REQUIRE(raw.points.size() > 5000);

  constexpr model::Utime kStart = 1'790'000'000'000'000;
  packets::Decoder decoder =
      packets::make_decoder({"ouster", ouster_json(metadata_of(lidar), true), "os.json"});
  std::vector<model::PointSweep> sweeps;
  for (const Message& packet : packets_of(raw, kStart * 1000, random)) {
    for (auto& sweep : add(decoder, {packet, kStart}).sweeps) sweeps.push_back(std::move(sweep));
  }

  REQUIRE(sweeps.size() == 1);
  REQUIRE(sweeps[0].points.size() == raw.points.size());
  CHECK(sweeps[0].rings == raw.rings);
  for (std::size_t i = 0; i < raw.points.size(); ++i) {
    const model::SweepPoint& point = sweeps[0].points[i];
    const double time_s = 1e-6 * static_cast<double>(sweeps[0].utime - kStart) + point.time_s;
    REQUIRE((point.position() - raw.points[i].position()).norm() < 0.0006F);
    REQUIRE(point.ring == raw.points[i].ring);
    REQUIRE(point.intensity == raw.points[i].intensity);
    REQUIRE(std::abs(time_s - raw.points[i].time_s) < 2e-6);
  }
}
