// The mapper's measurements between the submaps in a file.
#pragma once

#include <span>

#include "common/map_closure/part_graph.hpp"

namespace understory::cli {

/// Reads the ties from the submaps' payloads. Throws map_closure::ClosureError with the submap
/// where a payload is not from method `smoothing`. O(size).
map_closure::Ties stored_ties(std::span<const model::Submap> submaps);

}  // namespace understory::cli
