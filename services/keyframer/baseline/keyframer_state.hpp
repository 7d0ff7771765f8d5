// Everything that the thesis's keyframer remembers.
#pragma once

#include <string>
#include <vector>

#include "services/keyframer/baseline/observation.hpp"
#include "services/keyframer/keyframer_method.hpp"

namespace understory::keyframer::baseline {

/// The sets of GeoSLAM algorithm 2, and the counters.
struct KeyframerState {
  KeyframerCounters counters;
  std::vector<Observation> waiting;  ///< [otherObsv] Not matched yet, oldest first.
  std::vector<Observation> members;  ///< [kfObsv] Of the keyframe in progress, oldest first.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.counters, self.waiting, self.members);
  }
};

/// The state as bytes, in the format "keyframer.baseline" of common/state.
std::string save(const KeyframerState& state);
/// Throws std::invalid_argument on bytes that save() did not make. `descriptor_step` [s of the
/// perimeter] serves to build the hierarchies, which are not stored.
KeyframerState load_keyframer_state(const std::string& bytes, double descriptor_step);

}  // namespace understory::keyframer::baseline
