// Landmarks of the map that a keyframe saw.
#pragma once

#include <vector>

#include "common/model/map.hpp"

namespace understory::existence_tracker {

/// The landmarks matched by a keyframe, each once; merged ones by the id that remains.
/// O(associations log merges).
std::vector<model::LandmarkId> seen_landmarks(const model::MapUpdate& update);

}  // namespace understory::existence_tracker
