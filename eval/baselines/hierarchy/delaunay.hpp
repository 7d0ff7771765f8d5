// A Delaunay triangulation as plain indices.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::eval::baselines::hierarchy {

/// A triangle by the numbers of its points and of its neighbours.
struct DelaunayTriangle {
  std::array<std::uint32_t, 3> vertices{};  ///< Counter-clockwise.
  /// neighbours[i] lies across the edge vertices[i] -> vertices[i + 1]; -1 on the hull.
  std::array<std::int32_t, 3> neighbours{};
};

/// Triangulates `points` [m]. Coinciding points are represented by one of them; no triangle if all
/// lie on one line.
std::vector<DelaunayTriangle> delaunay(std::span<const Eigen::Vector2d> points);

}  // namespace understory::eval::baselines::hierarchy
