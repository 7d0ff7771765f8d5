// The Livox driver between the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::livox_driver {

/// Names of the channels that it publishes on.
struct LivoxDriverChannels {
  std::string raw_sweep = "RAW_SWEEP";
  std::string raw_imu = "RAW_IMU";
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with a wrong configuration, and ends with status 1 where a port is taken.
bus::Service livox_driver_service(const LivoxDriverChannels& channels = {});

}  // namespace understory::livox_driver
