// Outputs of a driver's stage, and counts of the sockets.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/result.hpp"

namespace understory::lidar_driver {

/// Results of one packet.
struct DriverOutput {
  std::vector<model::PointSweep> sweeps;  ///< Complete, frame `sensor`, with point times.
  std::vector<model::ImuSample> imu;
  std::vector<model::GnssFix> fixes;
  std::vector<wire::Refusal> faults;  ///< For HEALTH.
  bool is_refused = false;            ///< The packet was not used.
};

/// Counts of the sockets since the start.
struct SocketCounts {
  std::uint64_t overruns = 0;       ///< Packets that the kernel dropped.
  std::uint64_t other_senders = 0;  ///< Packets from other senders than the sensor.
};

/// One UDP port.
struct PortSettings {
  std::string name;     ///< "data", "imu": shown in LOG.
  int number = 0;       ///< 0 = any free one.
  std::string channel;  ///< Channel of this port's packets: shown in HEALTH.
};

/// Fault of a sensor's clock that does not give the time of day, or is too far from the computer's.
/// `offset_s`: computer's minus sensor's.
wire::Refusal clock_refusal(double offset_s, const std::string& without);

}  // namespace understory::lidar_driver
