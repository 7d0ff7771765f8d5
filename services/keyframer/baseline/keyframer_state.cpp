#include "services/keyframer/baseline/keyframer_state.hpp"

#include "common/model/archive.hpp"

namespace understory::keyframer::baseline {
namespace {

constexpr state::Format kFormat{"keyframer.baseline", 2};

void build_hierarchies(std::vector<Observation>& observations, double descriptor_step) {
  for (Observation& observation : observations) {
    observation.hierarchy = hierarchy::baseline::Hierarchy(observation.points, descriptor_step);
  }
}

}  // namespace

std::string save(const KeyframerState& state) { return state::save(kFormat, state); }

KeyframerState load_keyframer_state(const std::string& bytes, double descriptor_step) {
  KeyframerState loaded;
  state::load(bytes, kFormat, loaded);
  build_hierarchies(loaded.waiting, descriptor_step);
  build_hierarchies(loaded.members, descriptor_step);
  return loaded;
}

}  // namespace understory::keyframer::baseline
