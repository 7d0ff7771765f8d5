// The Hesai driver between the network and the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::hesai_driver {

/// Names of the channels that it publishes on.
struct HesaiDriverChannels {
  std::string raw_sweep = "RAW_SWEEP";
};

/// The service, for run_service(). Its adapter is a Device (common/bus/device.hpp). It refuses to
/// start with a wrong configuration, and ends with status 1 where a port is taken.
bus::Service hesai_driver_service(const HesaiDriverChannels& channels = {});

}  // namespace understory::hesai_driver
