// A fixed computation, to compare times across machines.
#pragma once

#include <cstddef>

namespace understory::eval::tools {

/// Fastest of `repeats` builds of CGAL's plain Delaunay triangulation of `points` uniform points
/// (the same ones every time) [s].
double delaunay_build_s(std::size_t points = 13770, int repeats = 5);

}  // namespace understory::eval::tools
