// What the mapper measured between the submaps that it left in a file.
#pragma once

#include <span>

#include "common/map_closure/part_graph.hpp"

namespace understory::cli {

/// From the submaps' payloads. Throws map_closure::ClosureError, naming the submap, where a
/// payload is not one of method `smoothing`. O(size).
map_closure::Ties stored_ties(std::span<const model::Submap> submaps);

}  // namespace understory::cli
