// The Ouster driver between the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::ouster_driver {

/// Names of the channels that it publishes on.
struct OusterDriverChannels {
  std::string raw_sweep = "RAW_SWEEP";
  std::string raw_imu = "RAW_IMU";
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with a wrong configuration, and ends with status 1 where a port is taken.
bus::Service ouster_driver_service(const OusterDriverChannels& channels = {});

}  // namespace understory::ouster_driver
