#include "services/existence_tracker/start_states.hpp"

#include "common/map_file/chosen_map.hpp"
#include "common/map_file/stored_existence.hpp"

namespace understory::existence_tracker {

std::vector<model::ExistenceState> read_start_states(const std::string& file, int map_id) {
  const map_file::MapFile maps(file, map_file::Access::kRead);
  return map_file::existence_of(maps, map_file::chosen_map(maps, map_id));
}

}  // namespace understory::existence_tracker
