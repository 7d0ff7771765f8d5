#include "eval/baselines/keyframer/clusters.hpp"

#include <algorithm>
#include <numeric>

namespace understory::eval::baselines::keyframer {
namespace {

/// The representative of `i`, with path halving.
std::uint32_t find_root(std::vector<std::uint32_t>& parents, std::uint32_t i) {
  while (parents[i] != i) {
    parents[i] = parents[parents[i]];
    i = parents[i];
  }
  return i;
}

/// Representatives such that each cluster's is its lowest number. Sweeps along x.
std::vector<std::uint32_t> link(std::span<const Eigen::Vector2d> points, double tolerance_m) {
  std::vector<std::uint32_t> parents(points.size());
  std::iota(parents.begin(), parents.end(), 0U);
  std::vector<std::uint32_t> order = parents;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return points[a].x() < points[b].x(); });

  for (std::size_t i = 0; i < order.size(); ++i) {
    const Eigen::Vector2d& point = points[order[i]];
    for (std::size_t j = i + 1; j < order.size() && points[order[j]].x() - point.x() <= tolerance_m;
         ++j) {
      if ((points[order[j]] - point).squaredNorm() <= tolerance_m * tolerance_m) {
        const std::uint32_t a = find_root(parents, order[i]);
        const std::uint32_t b = find_root(parents, order[j]);
        parents[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  return parents;
}

}  // namespace

std::vector<std::vector<std::uint32_t>> single_linkage(std::span<const Eigen::Vector2d> points,
                                                       double tolerance_m, std::size_t min_size,
                                                       std::size_t max_size) {
  std::vector<std::uint32_t> parents = link(points, tolerance_m);
  std::vector<std::vector<std::uint32_t>> members(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    members[find_root(parents, i)].push_back(i);
  }
  std::erase_if(members, [&](const auto& cluster) {
    return cluster.size() < min_size || cluster.size() > max_size;
  });
  std::stable_sort(members.begin(), members.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return members;
}

}  // namespace understory::eval::baselines::keyframer
