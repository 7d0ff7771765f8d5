#include "eval/baselines/hierarchy/delaunay.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <utility>

namespace understory::eval::baselines::hierarchy {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Triangulation_face_base_with_info_2<std::int32_t, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;

}  // namespace

std::vector<DelaunayTriangle> delaunay(std::span<const Eigen::Vector2d> points) {
  std::vector<std::pair<Kernel::Point_2, std::uint32_t>> numbered;
  numbered.reserve(points.size());
  for (const Eigen::Vector2d& point : points) {
    numbered.emplace_back(Kernel::Point_2(point.x(), point.y()),
                          static_cast<std::uint32_t>(numbered.size()));
  }

  Delaunay triangulation;
  triangulation.insert(numbered.begin(), numbered.end());
  if (triangulation.dimension() < 2) {
    return {};
  }

  std::int32_t count = 0;
  for (const auto face : triangulation.all_face_handles()) {
    face->info() = triangulation.is_infinite(face) ? -1 : count++;
  }

  std::vector<DelaunayTriangle> triangles;
  triangles.reserve(static_cast<std::size_t>(count));
  for (const auto face : triangulation.finite_face_handles()) {
    DelaunayTriangle triangle;
    for (int i = 0; i < 3; ++i) {
      const auto slot = static_cast<std::size_t>(i);
      triangle.vertices[slot] = face->vertex(i)->info();
      // CGAL numbers a neighbour by the vertex opposite to it.
      triangle.neighbours[slot] = face->neighbor((i + 2) % 3)->info();
    }
    triangles.push_back(triangle);
  }

  return triangles;
}

}  // namespace understory::eval::baselines::hierarchy
