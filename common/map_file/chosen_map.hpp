// Which of a file's maps is meant.
#pragma once

#include <cstdint>

#include "common/map_file/map_file.hpp"

namespace understory::map_file {

/// The number of the map that a drive begins with. `map_id` 0: the only one that has landmarks.
/// Throws std::runtime_error, which names the file and the maps that it has, where that cannot be
/// told or is not there.
std::uint32_t chosen_map(const MapFile& file, int map_id);

}  // namespace understory::map_file
