// Selects one of a file's maps.
#pragma once

#include <cstdint>

#include "common/map_file/map_file.hpp"

namespace understory::map_file {

/// The number of the map with which a drive begins. `map_id` 0: the only map with landmarks. Throws
/// std::runtime_error, with the file and its maps, where the choice is ambiguous or the map is
/// missing.
std::uint32_t chosen_map(const MapFile& file, int map_id);

}  // namespace understory::map_file
