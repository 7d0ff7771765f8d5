// Input and output of all packet decoders.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"

namespace understory::packets {

/// One UDP packet of a sensor.
struct Packet {
  std::span<const std::uint8_t> bytes;
  model::Utime received = 0;  ///< Reception time, computer's clock [us since 1970].
};

/// Fault of bytes that are no packet of the sensor.
enum class Fault : std::uint8_t {
  kWrongSize,
  kOtherModel,  ///< From another model, or in another format than configured.
  kDamaged,     ///< Impossible numbers.
  kLate,        ///< Belongs to a sweep that was already returned.
};
/// "wrong size", "another model or format", "damaged", "late".
std::string_view to_string(Fault fault);

/// Readings of one packet.
struct Readings {
  std::vector<model::PointSweep> sweeps;  ///< Complete sweeps; frame `sensor`, with point times.
  std::vector<model::ImuSample> imu;      ///< Frame `sensor`.
  std::vector<model::GnssFix> fixes;
  std::optional<Fault> fault;  ///< Set if the packet was not used.
};

/// Counts of a stream so far.
struct StreamCounts {
  std::uint64_t packets = 0;  ///< Packets added.
  std::uint64_t refused = 0;  ///< Packets with a fault.
  std::uint64_t sweeps = 0;   ///< Sweeps returned.
  std::uint64_t gaps = 0;     ///< Gaps of missing packets within sweeps.
  std::uint64_t jumps = 0;    ///< Jumps of the sensor's clock; the present sweep is dropped.
};

}  // namespace understory::packets
