#include "eval/baselines/hierarchy/hierarchy.hpp"

#include <algorithm>
#include <numeric>

namespace understory::eval::baselines::hierarchy {
namespace {

std::array<double, 3> edge_lengths(const std::array<std::uint32_t, 3>& vertices,
                                   std::span<const Eigen::Vector2d> points) {
  std::array<double, 3> lengths{};
  for (std::size_t i = 0; i < 3; ++i) {
    lengths[i] = (points[vertices[(i + 1) % 3]] - points[vertices[i]]).norm();
  }
  return lengths;
}

/// Where the boundary runs from `a` to `b`; its size if nowhere.
std::size_t find_edge(const std::vector<std::uint32_t>& boundary, std::uint32_t a,
                      std::uint32_t b) {
  const std::size_t n = boundary.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (boundary[i] == a && boundary[(i + 1) % n] == b) {
      return i;
    }
  }
  return n;
}

/// Joins two counter-clockwise boundaries across the edge that runs a -> b in `first` and b -> a in
/// `second`. The result starts at b, as in the published code: the start vertex is what the order
/// of merging made of it.
std::vector<std::uint32_t> join(std::vector<std::uint32_t> first, std::vector<std::uint32_t> second,
                                std::uint32_t a, std::uint32_t b) {
  const std::size_t in_first = find_edge(first, a, b);
  const std::size_t in_second = find_edge(second, b, a);
  std::rotate(first.begin(),
              first.begin() + static_cast<std::ptrdiff_t>((in_first + 1) % first.size()),
              first.end());  // b ... a
  std::rotate(second.begin(), second.begin() + static_cast<std::ptrdiff_t>(in_second),
              second.end());  // b a ...
  first.insert(first.end(), second.begin() + 2, second.end());
  return first;
}

/// Polygons while triangles are being joined; those without triangles were swallowed.
struct Joining {
  std::vector<std::uint32_t> owner;  ///< Of each triangle.
  std::vector<Polygon> polygons;
};

void join_across_longest_edge(std::uint32_t t, std::span<const Triangle> triangles,
                              std::span<const DelaunayTriangle> delaunay_triangles,
                              Joining& joining) {
  const auto& lengths = triangles[t].edge_lengths_m;
  const auto longest = static_cast<std::size_t>(
      std::distance(lengths.begin(), std::max_element(lengths.begin(), lengths.end())));
  const std::int32_t neighbour = delaunay_triangles[t].neighbours[longest];

  if (neighbour < 0) {
    return;  // On the hull: stays by itself unless a neighbour joins it.
  }

  const std::uint32_t mine = joining.owner[t];
  const std::uint32_t other = joining.owner[static_cast<std::size_t>(neighbour)];
  if (mine == other) {
    return;
  }

  Polygon& kept = joining.polygons[mine];
  Polygon& swallowed = joining.polygons[other];
  kept.vertices = join(std::move(kept.vertices), std::move(swallowed.vertices),
                       triangles[t].vertices[longest], triangles[t].vertices[(longest + 1) % 3]);

  for (const std::uint32_t moved : swallowed.triangles) {
    joining.owner[moved] = mine;
  }

  kept.triangles.insert(kept.triangles.end(), swallowed.triangles.begin(),
                        swallowed.triangles.end());
  swallowed = Polygon{};
}

}  // namespace

Hierarchy::Hierarchy(std::span<const Eigen::Vector2d> points, double descriptor_step) {
  const DescriptorMaker describe(descriptor_step);
  const std::vector<DelaunayTriangle> delaunay_triangles = delaunay(points);
  make_triangles(points, delaunay_triangles, describe);
  make_polygons(points, delaunay_triangles, describe);
  by_mean_radius_.resize(polygons_.size());
  std::iota(by_mean_radius_.begin(), by_mean_radius_.end(), 0U);
  std::stable_sort(by_mean_radius_.begin(), by_mean_radius_.end(),
                   [this](std::uint32_t a, std::uint32_t b) {
                     return polygons_[a].descriptor(0) < polygons_[b].descriptor(0);
                   });
}

void Hierarchy::make_triangles(std::span<const Eigen::Vector2d> points,
                               std::span<const DelaunayTriangle> delaunay_triangles,
                               const DescriptorMaker& describe) {
  triangles_.reserve(delaunay_triangles.size());
  for (const DelaunayTriangle& source : delaunay_triangles) {
    Triangle triangle;
    triangle.vertices = source.vertices;
    triangle.edge_lengths_m = edge_lengths(triangle.vertices, points);
    const std::array<Eigen::Vector2d, 3> corners{
        points[triangle.vertices[0]], points[triangle.vertices[1]], points[triangle.vertices[2]]};
    triangle.descriptor = describe(corners);
    triangles_.push_back(std::move(triangle));
  }
}

void Hierarchy::make_polygons(std::span<const Eigen::Vector2d> points,
                              std::span<const DelaunayTriangle> delaunay_triangles,
                              const DescriptorMaker& describe) {
  Joining joining;
  const auto count = static_cast<std::uint32_t>(triangles_.size());
  joining.owner.resize(count);
  std::iota(joining.owner.begin(), joining.owner.end(), 0U);
  joining.polygons.resize(count);

  for (std::uint32_t t = 0; t < count; ++t) {
    const auto& vertices = triangles_[t].vertices;
    joining.polygons[t].vertices.assign(vertices.begin(), vertices.end());
    joining.polygons[t].triangles = {t};
  }

  for (std::uint32_t t = 0; t < count; ++t) {
    join_across_longest_edge(t, triangles_, delaunay_triangles, joining);
  }

  std::vector<Eigen::Vector2d> boundary;
  for (Polygon& polygon : joining.polygons) {
    if (polygon.triangles.empty()) {
      continue;  // Swallowed by another.
    }
    boundary.clear();
    for (const std::uint32_t vertex : polygon.vertices) {
      boundary.push_back(points[vertex]);
    }
    polygon.descriptor = describe(boundary);
    polygons_.push_back(std::move(polygon));
  }
}

void Hierarchy::move_points(std::span<const Eigen::Vector2d> points) {
  for (Triangle& triangle : triangles_) {
    triangle.edge_lengths_m = edge_lengths(triangle.vertices, points);
  }
}

}  // namespace understory::eval::baselines::hierarchy
