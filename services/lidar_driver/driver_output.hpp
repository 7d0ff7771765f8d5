// What a driver's stage makes of a packet, and what it is told about the sockets.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/result.hpp"

namespace understory::lidar_driver {

/// What one packet brought.
struct DriverOutput {
  std::vector<model::PointSweep> sweeps;  ///< Whole, frame `sensor`, with point times.
  std::vector<model::ImuSample> imu;
  std::vector<model::GnssFix> fixes;
  std::vector<wire::Refusal> faults;  ///< For HEALTH.
  bool is_refused = false;            ///< The packet was not used.
};

/// What the sockets counted since the start.
struct SocketCounts {
  std::uint64_t overruns = 0;       ///< Packets that the kernel threw away.
  std::uint64_t other_senders = 0;  ///< Packets that were none of the sensor's.
};

/// One UDP port.
struct PortSettings {
  std::string name;     ///< "data", "imu": for LOG.
  int number = 0;       ///< 0 = any free one.
  std::string channel;  ///< Whose packets come here: HEALTH names it.
};

/// The sensor's clock where it does not show the time of day, or is too far from the computer's.
/// `offset_s`: how far the computer's is ahead.
wire::Refusal clock_refusal(double offset_s, const std::string& without);

}  // namespace understory::lidar_driver
