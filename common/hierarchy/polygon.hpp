// Urquhart polygons: a triangulation without the longest edge of each triangle.
#pragma once

#include <cstdint>
#include <vector>

#include "common/hierarchy/descriptor.hpp"
#include "common/hierarchy/triangulation.hpp"

namespace understory::hierarchy {

/// A set of triangles connected across longest edges (GeoSLAM algorithm 1, components merged as in
/// its published code). The dual of such a set is a tree (lengths never decrease along its
/// branches, and only two triangles can share their longest edge), so its boundary is one closed
/// walk of triangles + 2 edges; it may pass a landmark, or both sides of an edge, twice.
struct Polygon {
  /// Landmark slots along the boundary, counter-clockwise, starting so that the sequence of ids is
  /// smallest. Empty where the polygon does not exist.
  std::vector<std::uint32_t> boundary;
  std::vector<std::uint32_t> triangles;  ///< Indices in the triangulation.
  Descriptor descriptor{};
  /// Edges on the convex hull. They are the border of the view, not of the forest.
  std::uint32_t hull_edges = 0;

  /// False for a free index.
  bool exists() const { return !boundary.empty(); }
  /// Whether the border of the view may cut off the polygon.
  bool touches_hull() const { return hull_edges > 0; }
};

/// Whether edge `edge` of triangle `index` lies inside a polygon: it is the longest edge of a
/// triangle on one of its sides, and not on the hull.
bool is_dropped(const Triangulation& triangulation, std::uint32_t index, int edge);

/// Boundary of a connected set of triangles, in the order of Polygon::boundary. Precondition: the
/// set is complete, i.e. closed under is_dropped.
std::vector<std::uint32_t> boundary_of(const Triangulation& triangulation,
                                       const std::vector<std::uint32_t>& triangles);

/// Number of edges of these triangles that lie on the hull.
std::uint32_t count_hull_edges(const Triangulation& triangulation,
                               const std::vector<std::uint32_t>& triangles);

}  // namespace understory::hierarchy
