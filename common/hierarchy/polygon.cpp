#include "common/hierarchy/polygon.hpp"

#include <algorithm>

namespace understory::hierarchy {
namespace {

int index_in(const Triangle& triangle, std::uint32_t vertex) {
  return triangle.vertices[0] == vertex ? 0 : (triangle.vertices[1] == vertex ? 1 : 2);
}

/// Rotates the walk so that its sequence of ids is smallest.
void start_at_smallest(const Triangulation& triangulation, std::vector<std::uint32_t>& walk) {
  const std::size_t size = walk.size();
  const auto id = [&](std::size_t start, std::size_t i) {
    return triangulation.id(walk[(start + i) % size]);
  };

  std::size_t best = 0;
  for (std::size_t start = 1; start < size; ++start) {
    std::size_t i = 0;
    while (i < size && id(start, i) == id(best, i)) {
      ++i;
    }
    if (i < size && id(start, i) < id(best, i)) {
      best = start;
    }
  }

  std::rotate(walk.begin(), walk.begin() + static_cast<std::ptrdiff_t>(best), walk.end());
}

}  // namespace

bool is_dropped(const Triangulation& triangulation, std::uint32_t index, int edge) {
  const Triangle& triangle = triangulation.triangles()[index];
  const std::uint32_t across = triangle.neighbours[edge];
  if (across == kNone) {
    return false;
  }
  if (triangle.longest_edge == static_cast<std::uint32_t>(edge)) {
    return true;
  }
  const Triangle& neighbour = triangulation.triangles()[across];
  return neighbour.neighbours[neighbour.longest_edge] == index;
}

std::vector<std::uint32_t> boundary_of(const Triangulation& triangulation,
                                       const std::vector<std::uint32_t>& triangles) {
  // An edge that is not dropped exists: a tree of n triangles has 3n - 2(n - 1) > 0 of them.
  std::uint32_t index = triangles.front();
  int edge = 0;
  for (const std::uint32_t candidate : triangles) {
    for (int i = 0; i < 3; ++i) {
      if (!is_dropped(triangulation, candidate, i)) {
        index = candidate;
        edge = i;
      }
    }
  }

  // Walk: note the start of each boundary edge, then rotate about its end to the next one.
  std::vector<std::uint32_t> walk;
  const std::size_t length = triangles.size() + 2;
  walk.reserve(length);

  while (walk.size() < length) {
    const Triangle* triangle = &triangulation.triangles()[index];
    walk.push_back(triangle->vertices[(edge + 1) % 3]);
    const std::uint32_t end = triangle->vertices[(edge + 2) % 3];
    edge = (index_in(*triangle, end) + 2) % 3;
    while (is_dropped(triangulation, index, edge)) {
      const std::uint32_t across = triangle->neighbours[edge];
      triangle = &triangulation.triangles()[across];
      index = across;
      edge = (index_in(*triangle, end) + 2) % 3;
    }
  }

  start_at_smallest(triangulation, walk);
  return walk;
}

std::uint32_t count_hull_edges(const Triangulation& triangulation,
                               const std::vector<std::uint32_t>& triangles) {
  std::uint32_t count = 0;
  for (const std::uint32_t index : triangles) {
    const auto& neighbours = triangulation.triangles()[index].neighbours;
    count += static_cast<std::uint32_t>(std::count(neighbours.begin(), neighbours.end(), kNone));
  }
  return count;
}

}  // namespace understory::hierarchy
