// The Velodyne driver's place between the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::velodyne_driver {

struct VelodyneDriverChannels {
  std::string raw_sweep = "RAW_SWEEP";
  std::string raw_gnss = "RAW_GNSS";
};

/// Its adapter is a Device (common/bus/device.hpp).
bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels = {});

}  // namespace understory::velodyne_driver
