// The services that this build knows, for commands that host them in one process.
#pragma once

#include <vector>

#include "common/bus/service.hpp"

namespace understory {

/// In the order in which data runs through them.
std::vector<Service> all_services();

}  // namespace understory
