#include "services/geoslam_mapper/smoothing/map_archive.hpp"

#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr state::Format kWholeMapFormat{"geoslam_mapper.smoothing.map", 4};

std::size_t parts_of(const std::deque<KeptMap>& maps) {
  std::size_t parts = 0;
  for (const KeptMap& map : maps) parts += map.landmarks.size() + map.keyframes.size();
  return parts;
}

}  // namespace

KeptMap keep(const GlobalMap& map, const CommonError& common) {
  KeptMap result;
  result.id = map.landmarks.map_id();
  result.keyframes = told_poses(map, common);
  result.landmarks = told_landmarks(map, common);
  result.whole = state::save(kWholeMapFormat, map);
  return result;
}

GlobalMap opened(const KeptMap& kept, const SmoothingMapperParameters& parameters) {
  GlobalMap map(parameters, kept.id);
  state::load(kept.whole, kWholeMapFormat, map);
  return map;
}

std::vector<std::uint32_t> MapArchive::add(KeptMap map) {
  maps_.push_back(std::move(map));
  if (maps_.size() > kMostWhole) {
    std::string& whole = maps_[maps_.size() - kMostWhole - 1].whole;
    whole.clear();
    whole.shrink_to_fit();
  }

  std::vector<std::uint32_t> forgotten;
  while (maps_.size() > kMost || (maps_.size() > 1 && parts_of(maps_) > kMostParts)) {
    forgotten.push_back(maps_.front().id);
    maps_.pop_front();
  }
  return forgotten;
}

}  // namespace understory::geoslam_mapper::smoothing
