// The geometric hierarchy around the vehicle, for the page.
#pragma once

#include <cstdint>
#include <vector>

#include "services/viewer/scene.hpp"

namespace understory::viewer {

/// Edges between slots.
struct HierarchyOverlay {
  std::vector<std::uint32_t> from;
  std::vector<std::uint32_t> to;
  std::vector<std::uint8_t> level;  ///< 1: on a polygon's boundary, 0: inside one.
};

/// Of the landmarks within 60 m of the vehicle, the 600 nearest at most: a few milliseconds.
HierarchyOverlay hierarchy_around_vehicle(const Scene& scene);

}  // namespace understory::viewer
