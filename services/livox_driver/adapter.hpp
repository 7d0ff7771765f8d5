// Connects the Livox driver to the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::livox_driver {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct LivoxDriverChannels {
  bus::ChannelList all{"UDP packets of a Livox laser (points port, imu port)"};
  std::string raw_sweep = all.out("RAW_SWEEP", "sweeps of 0.1 s, in parts");
  std::string raw_imu = all.out("RAW_IMU", "samples of its IMU");
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with an invalid configuration, and ends with status 1 if a port is in use.
bus::Service livox_driver_service(const LivoxDriverChannels& channels = {});

}  // namespace understory::livox_driver
