// Connects the Ouster driver to the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::ouster_driver {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct OusterDriverChannels {
  bus::ChannelList all{"UDP packets of an Ouster laser (lidar port, imu port)"};
  std::string raw_sweep = all.out("RAW_SWEEP", "frames of the laser, in parts");
  std::string raw_imu = all.out("RAW_IMU", "samples of its IMU");
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with an invalid configuration, and ends with status 1 if a port is in use.
bus::Service ouster_driver_service(const OusterDriverChannels& channels = {});

}  // namespace understory::ouster_driver
