// Everything that the source's keyframer remembers, and its bytes.
#pragma once

#include <string>
#include <vector>

#include "services/keyframer/baseline/observation.hpp"
#include "services/keyframer/keyframer.hpp"

namespace understory::keyframer::baseline {

struct KeyframerState {
  KeyframerCounters counters;
  std::vector<Observation> waiting;  ///< Matched with nothing yet, oldest first.
  std::vector<Observation> members;  ///< Of the keyframe in the making, oldest first.
};

/// CBOR. Hierarchies are not stored: load makes them again from the points.
std::string save(const KeyframerState& state);
/// Throws std::invalid_argument on bytes that save() did not make.
KeyframerState load_keyframer_state(const std::string& bytes, double descriptor_step);

}  // namespace understory::keyframer::baseline
