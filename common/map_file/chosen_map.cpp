#include "common/map_file/chosen_map.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace understory::map_file {
namespace {

std::string numbers_in(const std::vector<MapSummary>& maps) {
  std::string result;
  for (const MapSummary& map : maps)
    result += (result.empty() ? "" : ", ") + std::to_string(map.map_id);
  return result;
}

}  // namespace

std::uint32_t chosen_map(const MapFile& file, int map_id) {
  const std::vector<MapSummary> all = file.maps();
  // Merging leaves trajectories as maps without landmarks.
  const auto has_landmarks = [](const auto& map) { return map.trunks + map.corners > 0; };
  const auto only = std::ranges::find_if(all, has_landmarks);
  if (map_id == 0 && std::ranges::count_if(all, has_landmarks) == 1) return only->map_id;
  if (map_id == 0 && all.size() == 1) return all.front().map_id;

  for (const MapSummary& map : all)
    if (map_id > 0 && map.map_id == static_cast<std::uint32_t>(map_id)) return map.map_id;

  if (all.empty()) throw std::runtime_error(file.file().string() + ": no map is in it");
  throw std::runtime_error(file.file().string() + ": input.map_id is " + std::to_string(map_id) +
                           ", the file has map " + numbers_in(all) +
                           (map_id == 0 ? "; say which one" : ""));
}

}  // namespace understory::map_file
