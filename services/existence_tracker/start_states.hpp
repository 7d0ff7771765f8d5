// Initial states of the tracker, stored with a map.
#pragma once

#include <string>
#include <vector>

#include "common/model/existence.hpp"

namespace understory::existence_tracker {

/// The states of one map of a map file; none if it was stored without. `map_id` 0: the only map in
/// the file that has landmarks, as for the mapper. Throws map_file::MapFileError, or
/// std::runtime_error with the name of the file if there is no such map.
std::vector<model::ExistenceState> read_start_states(const std::string& file, int map_id);

}  // namespace understory::existence_tracker
