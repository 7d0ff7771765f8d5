#include "eval/tools/yardstick.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <random>
#include <vector>

namespace understory::eval::tools {

double delaunay_build_s(std::size_t points, int repeats) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Clock = std::chrono::steady_clock;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> anywhere(0.0, 1000.0);
  std::vector<Kernel::Point_2> cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const double x = anywhere(random);
    cloud.emplace_back(x, anywhere(random));
  }
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    const auto start = Clock::now();
    const CGAL::Delaunay_triangulation_2<Kernel> triangulation(cloud.begin(), cloud.end());
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (triangulation.number_of_vertices() > 0) best = std::min(best, seconds);
  }
  return best;
}

}  // namespace understory::eval::tools
