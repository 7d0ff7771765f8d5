// Connects the Velodyne driver to the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::velodyne_driver {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct VelodyneDriverChannels {
  bus::ChannelList all{"UDP packets of a Velodyne laser (data port, position port)"};
  std::string raw_sweep = all.out("RAW_SWEEP", "revolutions of the laser, in parts");
  std::string raw_gnss = all.out("RAW_GNSS", "fixes of its GNSS receiver");
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with an invalid configuration, and ends with status 1 if a port is in use.
bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels = {});

}  // namespace understory::velodyne_driver
