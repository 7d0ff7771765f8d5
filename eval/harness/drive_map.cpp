#include "eval/harness/drive_map.hpp"

#include <unistd.h>

#include <optional>
#include <system_error>

#include "common/map_file/map_file.hpp"
#include "common/map_file/stored_existence.hpp"

namespace understory::eval::harness {

void write_drive_map(const ChainRun& run, const std::string& name,
                     const std::filesystem::path& file) {
  map_file::StoredMap map;
  map.map_id = model::map_of(run.landmarks.back().id);
  map.name = name;
  map.created_utime = run.updates.back().utime;
  map.keyframes = run.keyframes;
  for (const model::MapLandmark& landmark : run.landmarks)
    map.landmarks.push_back({landmark, std::nullopt, std::nullopt});

  map_file::NewestExistence newest;
  for (const model::ExistenceState& state : run.existence_states) newest.take(state);
  if (!newest.empty()) map_file::give_existence(map, newest.stored());
  map_file::create_map_file(file, {&map, 1}, {map.created_utime, "eval", "a drive", "its map"});
}

MapFolder::MapFolder(const std::string& name)
    : path_(std::filesystem::temp_directory_path() /
            ("understory-" + name + "-" + std::to_string(::getpid()))) {
  std::filesystem::create_directories(path_);
}

MapFolder::~MapFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace understory::eval::harness
