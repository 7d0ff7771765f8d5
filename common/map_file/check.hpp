// Finds faults of a map file.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// One line for each fault; see MapFile::check. Damage causes no exception.
std::vector<std::string> findings_in(const Connection& connection);

}  // namespace understory::map_file
