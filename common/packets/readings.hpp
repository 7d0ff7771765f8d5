// What a laser's packets are decoded from and to, whoever made the laser.
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
  model::Utime received = 0;  ///< By the computer's clock [us since 1970].
};

/// Why bytes are no packet of the sensor.
enum class Fault : std::uint8_t {
  kWrongSize,
  kOtherModel,  ///< Of another model, or in another format than the sensor is set to.
  kDamaged,     ///< Numbers that no packet has.
  kLate,        ///< Of a sweep that has been given out.
};
/// "wrong size", "another model or format", "damaged", "late".
std::string_view to_string(Fault fault);

/// What one packet brought.
struct Readings {
  std::vector<model::PointSweep> sweeps;  ///< Whole; frame `sensor`, with point times.
  std::vector<model::ImuSample> imu;      ///< Frame `sensor`.
  std::vector<model::GnssFix> fixes;
  std::optional<Fault> fault;  ///< The packet was not used.
};

/// What a stream saw so far.
struct StreamCounts {
  std::uint64_t packets = 0;  ///< All that were added.
  std::uint64_t refused = 0;  ///< With a fault.
  std::uint64_t sweeps = 0;   ///< Given out.
  std::uint64_t gaps = 0;     ///< Times that packets were missing inside of sweeps.
  std::uint64_t jumps = 0;    ///< Of the sensor's clock; the sweep in progress is left out.
};

}  // namespace understory::packets
