// What a keyframe saw of the map.
#pragma once

#include <vector>

#include "common/model/map.hpp"

namespace understory::existence_tracker {

/// The landmarks that a keyframe was matched to, each once; of those that it merged the one that
/// lives on. O(associations log merges).
std::vector<model::LandmarkId> seen_landmarks(const model::MapUpdate& update);

}  // namespace understory::existence_tracker
