// The parts of Triangulation without CGAL.
#include <algorithm>
#include <tuple>

#include "common/hierarchy/triangulation.hpp"

namespace understory::hierarchy {

void TriangulationChange::clear() {
  removed.clear();
  made.clear();
  rim.clear();
}

void TriangulationChange::prepend(const TriangulationChange& earlier,
                                  std::span<const Triangle> triangles) {
  removed.insert(removed.begin(), earlier.removed.begin(), earlier.removed.end());
  made.insert(made.begin(), earlier.made.begin(), earlier.made.end());
  rim.insert(rim.begin(), earlier.rim.begin(), earlier.rim.end());
  const auto is_gone = [&](std::uint32_t index) { return triangles[index].vertices[0] == kNone; };
  std::erase_if(made, is_gone);
  std::erase_if(rim, is_gone);
  std::sort(made.begin(), made.end());
  made.erase(std::unique(made.begin(), made.end()), made.end());
}

std::optional<std::uint32_t> Triangulation::slot(std::uint64_t id) const {
  const auto found = slot_of_id_.find(id);
  return found == slot_of_id_.end() ? std::nullopt : std::optional(found->second);
}

void Triangulation::find_longest_edge(Triangle& triangle) const {
  // Squared length, then ids: a strict order of all edges.
  const auto rank = [&](std::uint32_t edge) {
    const std::uint32_t a = triangle.vertices[(edge + 1) % 3];
    const std::uint32_t b = triangle.vertices[(edge + 2) % 3];
    return std::tuple((positions_[a] - positions_[b]).squaredNorm(), std::max(ids_[a], ids_[b]),
                      std::min(ids_[a], ids_[b]));
  };
  triangle.longest_edge = 0;
  for (std::uint32_t edge = 1; edge < 3; ++edge) {
    if (rank(edge) > rank(triangle.longest_edge)) {
      triangle.longest_edge = edge;
    }
  }
}

}  // namespace understory::hierarchy
