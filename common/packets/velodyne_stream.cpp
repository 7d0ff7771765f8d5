#include "common/packets/velodyne_stream.hpp"

namespace understory::packets {
namespace {

Fault fault_of(io::VelodynePacketFault fault) {
  switch (fault) {
    case io::VelodynePacketFault::kWrongSize:
      return Fault::kWrongSize;
    case io::VelodynePacketFault::kOtherModel:
      return Fault::kOtherModel;
    case io::VelodynePacketFault::kDamaged:
      break;
  }
  return Fault::kDamaged;
}

}  // namespace

Readings VelodyneStream::add(const Packet& packet) {
  Readings readings;
  if (packet.bytes.size() == io::kVelodynePositionBytes) {
    const auto position = io::parse_velodyne_position(packet.bytes);
    if (!position) return readings;
    if (const auto fix = fixes_.add(*position, packet.received)) readings.fixes.push_back(*fix);
    return readings;
  }

  if (const auto fault = io::check_velodyne_packet(packet.bytes, model_))
    readings.fault = fault_of(*fault);
  if (auto sweep = decoder_.add(packet.bytes, packet.received))
    readings.sweeps.push_back(*std::move(sweep));
  counts_ = {decoder_.counts().packets, decoder_.counts().refused, decoder_.counts().turns,
             decoder_.counts().lost_azimuth, 0};
  return readings;
}

std::optional<model::PointSweep> VelodyneStream::finish() {
  auto sweep = decoder_.finish();
  if (sweep) ++counts_.sweeps;
  return sweep;
}

}  // namespace understory::packets
