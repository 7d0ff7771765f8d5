// A map to begin with: from a file or from a message.
#pragma once

#include <string>
#include <vector>

#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// The landmarks of one map of a map file, in order of id. `map_id` 0: the only one in the file
/// that has landmarks. Throws map_file::MapFileError, or std::runtime_error that names the file
/// where that map is not in it or has no landmark.
std::vector<model::MapLandmark> read_given_map(const std::string& file, int map_id);

/// Why a message's map cannot be begun with; empty where it can: it is whole, has landmarks, and
/// all of them are finite and in order of id.
std::string why_not_given(const model::WholeMap& map);

}  // namespace understory::geoslam_mapper
