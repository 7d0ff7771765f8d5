// The stage of the drivers whose sensors give their full time: packets in, sweeps and samples out,
// and what is wrong with the packets.
//
// Stamps: with time source "sensor" those of the decoder, so that a capture's import has the same.
// With "received" the offset between the clocks, by the packets that were least delayed, is added.
#pragma once

#include <optional>
#include <string>

#include "common/packets/decoder.hpp"
#include "services/lidar_driver/driver_output.hpp"
#include "services/lidar_driver/least_delay.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::lidar_driver {

/// Decodes packets, stamps what is in them and says what is wrong. No state outlives a restart.
class PacketStage {
 public:
  /// `decoder`: of a sensor with a SensorClock.
  PacketStage(packets::Decoder decoder, TimeParameters time);

  /// Takes a packet of any of the sensor's ports. `size`: of the packet as sent, where `bytes`
  /// holds only its begin. `received`: by the computer's clock [us].
  DriverOutput add(std::size_t port, std::span<const std::uint8_t> bytes, std::size_t size,
                   model::Utime received);
  /// The sweep in progress, where it is almost whole.
  std::optional<model::PointSweep> finish();
  /// What is wrong with the sensor's clock now, if anything is.
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

/// The stage of a sensor. `sensor.source`: a file to be read, as the parameter `key` says; empty =
/// none. Throws ConfigurationError, which names `key`.
PacketStage make_stage(packets::SensorDescription sensor, const std::string& key,
                       const TimeParameters& time);

}  // namespace understory::lidar_driver
