// The services in this build, for commands that host them in one process.
#pragma once

#include <vector>

#include "common/bus/service.hpp"

namespace understory::cli {

/// Every service but the sensor services, in the order of the data flow.
std::vector<bus::Service> all_services();
/// Services that read a sensor themselves: they run as processes only; in a replay the log replaces
/// them.
std::vector<bus::Service> sensor_services();

}  // namespace understory::cli
