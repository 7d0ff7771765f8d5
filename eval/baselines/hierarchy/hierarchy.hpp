// The geometric hierarchy as published (GeoSLAM §3.2.1, algorithm 1), built from scratch.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "eval/baselines/hierarchy/delaunay.hpp"
#include "eval/baselines/hierarchy/descriptor.hpp"

namespace understory::eval::baselines::hierarchy {

/// A Delaunay triangle; vertices are numbers of points.
struct Triangle {
  std::array<std::uint32_t, 3> vertices{};
  /// edge_lengths_m[i] is that of vertices[i] -> vertices[i + 1], opposite vertices[i + 2].
  std::array<double, 3> edge_lengths_m{};
  Descriptor descriptor;
};

/// Triangles joined across the longest edge of any of them. A vertex inside appears more than once
/// on the boundary: a polygon of m triangles always has m + 2 sides.
struct Polygon {
  std::vector<std::uint32_t> vertices;
  std::vector<std::uint32_t> triangles;
  Descriptor descriptor;
};

/// Triangles and polygons of one set of points, numbered as given.
class Hierarchy {
 public:
  Hierarchy() = default;
  /// Triangulates `points` [m]; `descriptor_step` [s].
  Hierarchy(std::span<const Eigen::Vector2d> points, double descriptor_step);

  /// Takes moved points (same count, same numbers): edge lengths follow. Descriptors and structure
  /// stay as they were built, as in the published code, which computes new descriptors on a copy
  /// and drops it (GeoSLAM §4.3.5 lets descriptors follow too).
  void move_points(std::span<const Eigen::Vector2d> points);

  /// All triangles, by number.
  std::span<const Triangle> triangles() const { return triangles_; }
  /// All polygons, by number.
  std::span<const Polygon> polygons() const { return polygons_; }
  /// Numbers of the polygons in ascending order of descriptor(0).
  std::span<const std::uint32_t> by_mean_radius() const { return by_mean_radius_; }

 private:
  void make_triangles(std::span<const Eigen::Vector2d> points,
                      std::span<const DelaunayTriangle> delaunay_triangles,
                      const DescriptorMaker& describe);
  void make_polygons(std::span<const Eigen::Vector2d> points,
                     std::span<const DelaunayTriangle> delaunay_triangles,
                     const DescriptorMaker& describe);

  std::vector<Triangle> triangles_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> by_mean_radius_;
};

}  // namespace understory::eval::baselines::hierarchy
