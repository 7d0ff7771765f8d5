// Connects the Hesai driver to the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::hesai_driver {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct HesaiDriverChannels {
  bus::ChannelList all{"UDP packets of a Hesai laser (data port)"};
  std::string raw_sweep = all.out("RAW_SWEEP", "revolutions of the laser, in parts");
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with an invalid configuration, and ends with status 1 if a port is in use.
bus::Service hesai_driver_service(const HesaiDriverChannels& channels = {});

}  // namespace understory::hesai_driver
