// The Velodyne driver between the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::velodyne_driver {

/// Names of the channels that it publishes on.
struct VelodyneDriverChannels {
  std::string raw_sweep = "RAW_SWEEP";
  std::string raw_gnss = "RAW_GNSS";
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with a wrong configuration, and ends with status 1 where a port is taken.
bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels = {});

}  // namespace understory::velodyne_driver
