// Separate from triangulation.cpp to reduce compile time.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include "common/hierarchy/triangulation.hpp"

namespace understory::hierarchy {

std::vector<std::uint32_t> insertion_order(std::span<const Eigen::Vector2d> positions_m) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_2> points;
  std::vector<std::size_t> order;
  points.reserve(positions_m.size());
  order.reserve(positions_m.size());

  for (const Eigen::Vector2d& position : positions_m) {
    order.push_back(points.size());
    points.emplace_back(position.x(), position.y());
  }

  const auto map = CGAL::make_property_map(points);
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_2<Kernel, decltype(map)>(map));

  return {order.begin(), order.end()};
}

}  // namespace understory::hierarchy
