// The stage of drivers whose sensors send the full time: packets in, sweeps, samples and packet
// faults out.
//
// Stamps: with time source "sensor" those of the decoder, equal to the import of a capture. With
// "received" the offset between the clocks, from the least delayed packets, is added.
#pragma once

#include <optional>
#include <string>

#include "common/packets/decoder.hpp"
#include "services/lidar_driver/driver_output.hpp"
#include "services/lidar_driver/least_delay.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::lidar_driver {

/// Decodes packets, stamps their content and reports faults. No state survives a restart.
class PacketStage {
 public:
  /// `decoder`: of a sensor with a SensorClock.
  PacketStage(packets::Decoder decoder, TimeParameters time);

  /// Adds a packet of any of the sensor's ports. `size`: of the packet as sent, if `bytes` holds
  /// only its beginning. `received`: by the computer's clock [us].
  DriverOutput add(std::size_t port, std::span<const std::uint8_t> bytes, std::size_t size,
                   model::Utime received);
  /// The sweep in progress, if it is almost complete.
  std::optional<model::PointSweep> finish();
  /// Present fault of the sensor's clock, if any.
  std::optional<wire::Refusal> clock_fault() const;
  /// The counts since the start, for LOG.
  std::string summary(const SocketCounts& sockets) const;

 private:
  model::Utime offset_us() const;
  void report_new(DriverOutput& output);

  packets::Decoder decoder_;
  TimeParameters time_;
  LeastDelay delay_;
  std::uint64_t faults_[4] = {};      ///< By packets::Fault.
  std::size_t largest_good_ = 0;      ///< Packet [bytes].
  std::uint64_t gaps_reported_ = 0;   ///< Of the decoder's count.
  std::uint64_t jumps_reported_ = 0;  ///< Of the decoder's count.
  std::uint64_t imu_samples_ = 0;
};

/// The stage of a sensor. `sensor.source`: a file to read, from the parameter `key`; empty = none.
/// Throws ConfigurationError with `key` in the message.
PacketStage make_stage(packets::SensorDescription sensor, const std::string& key,
                       const TimeParameters& time);

}  // namespace understory::lidar_driver
