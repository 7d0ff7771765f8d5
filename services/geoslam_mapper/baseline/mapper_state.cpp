#include "services/geoslam_mapper/baseline/mapper_state.hpp"

#include <stdexcept>

#include "common/state/archive.hpp"

namespace understory::geoslam_mapper::baseline {
namespace {

constexpr state::Format kFormat{"geoslam_mapper.baseline", 1};

}  // namespace

std::string save(const MapperState& state) {
  return state::save(kFormat, state.map, state.hierarchy_points_m);
}

MapperState load_mapper_state(const std::string& bytes, double descriptor_step) {
  MapperState state;
  state::load(bytes, kFormat, state.map, state.hierarchy_points_m);
  const MapContents& map = state.map;
  if (map.landmarks.size() != map.graph.landmarks_m.size() ||
      map.poses.size() != map.graph.poses.size()) {
    throw std::invalid_argument("baseline mapper state: its graph does not fit its records");
  }

  state.hierarchy = hierarchy::baseline::Hierarchy(state.hierarchy_points_m, descriptor_step);
  if (!state.hierarchy_points_m.empty()) state.hierarchy.move_points(map.graph.landmarks_m);
  return state;
}

}  // namespace understory::geoslam_mapper::baseline
