// What is wrong with a map file.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// A line for each thing that is wrong; see MapFile::check. Nothing is thrown for damage.
std::vector<std::string> findings_in(const Connection& connection);

}  // namespace understory::map_file
