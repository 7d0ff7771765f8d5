#include "common/hierarchy/constellation_observation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace understory::constellation {
namespace {

constexpr int kMaxNeighbours = 8;

struct NearestIndices {
  std::array<std::uint32_t, kMaxNeighbours> index{};
  int count = 0;
  bool has(std::uint32_t wanted) const {
    return std::find(index.begin(), index.begin() + count, wanted) != index.begin() + count;
  }
};

/// Points sorted by x: neighbours of one are sought to both sides, until x alone is too far.
std::vector<NearestIndices> nearest_indices(const std::vector<PreparedPoint>& points, int wanted) {
  struct ByX {
    double x;
    double y;
    std::uint32_t index;
  };
  std::vector<ByX> order(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    order[i] = {points[i].position.x(), points[i].position.y(), i};
  }
  std::sort(order.begin(), order.end(), [](const ByX& a, const ByX& b) {
    return a.x < b.x || (a.x == b.x && a.index < b.index);
  });
  std::vector<NearestIndices> nearest(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    std::array<double, kMaxNeighbours> squared{};
    NearestIndices& list = nearest[order[i].index];
    // True while the walk may go on.
    const auto consider = [&](const ByX& other) {
      const double dx = other.x - order[i].x;
      const double dy = other.y - order[i].y;
      const double d = dx * dx + dy * dy;
      if (list.count == wanted) {
        const double farthest = squared[static_cast<std::size_t>(wanted) - 1];
        if (dx * dx > farthest) return false;
        if (d >= farthest) return true;
      }
      auto k = static_cast<std::size_t>(list.count < wanted ? list.count++ : wanted - 1);
      for (; k > 0 && d < squared[k - 1]; --k) {
        squared[k] = squared[k - 1];
        list.index[k] = list.index[k - 1];
      }
      squared[k] = d;
      list.index[k] = other.index;
      return true;
    };
    // Both ways in turn, so that the list is short of far points early.
    std::size_t down = i;
    std::size_t up = i + 1;
    bool go_down = down > 0;
    bool go_up = up < order.size();
    while (go_down || go_up) {
      if (go_down) go_down = consider(order[--down]) && down > 0;
      if (go_up) go_up = consider(order[up++]) && up < order.size();
    }
  }
  return nearest;
}

bool flat(const Triangle& triangle, const std::vector<PreparedPoint>& points) {
  const PreparedPoint& a = points[triangle.vertex[0]];
  const PreparedPoint& b = points[triangle.vertex[1]];
  const PreparedPoint& c = points[triangle.vertex[2]];
  const Eigen::Vector2d u = b.position - a.position;
  const Eigen::Vector2d v = c.position - a.position;
  const double height = std::abs(u.x() * v.y() - u.y() * v.x()) / triangle.side_m[0];
  return height * height < 9.0 * std::max({a.variance, b.variance, c.variance}) ||
         !(triangle.side_m[2] > 0.0F);
}

}  // namespace

PreparedObservation prepare(std::span<const ObservedPoint> points,
                            const LocaliseParameters& parameters) {
  PreparedObservation prepared;
  prepared.points.reserve(points.size());
  prepared.observed.reserve(points.size());
  const double map_variance = parameters.map_sigma_m * parameters.map_sigma_m;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const ObservedPoint& point = points[i];
    if (!PointGrid::representable(point.position_m) || !(std::abs(point.sigma_m) < 1e3)) continue;
    const double variance = std::max(point.sigma_m * point.sigma_m, map_variance) + map_variance;
    prepared.points.push_back({point.position_m, variance});
    prepared.observed.push_back(i);
    prepared.centre += point.position_m;
  }
  if (prepared.points.empty()) return prepared;
  const auto n = static_cast<double>(prepared.points.size());
  prepared.centre /= n;
  double moment = 0.0;
  for (const auto& point : prepared.points) {
    moment += (point.position - prepared.centre).squaredNorm();
  }
  const double area = std::max(1.0, 2.0 * std::numbers::pi * moment / n);
  prepared.radius_m = std::sqrt(area / std::numbers::pi);
  prepared.density_per_m2 = n / area;
  return prepared;
}

std::vector<Triangle> triangles_of(const PreparedObservation& observation, int neighbours) {
  const int wanted = std::clamp(neighbours, 2, kMaxNeighbours);
  const auto nearest = nearest_indices(observation.points, wanted);
  const auto corner = [&](std::uint32_t index) {
    return Corner{index, index, observation.points[index].position};
  };
  std::vector<Triangle> triangles;
  triangles.reserve(nearest.size() * static_cast<std::size_t>(wanted * (wanted - 1) / 2));
  for (std::uint32_t a = 0; a < nearest.size(); ++a) {
    for (int i = 0; i < nearest[a].count; ++i) {
      for (int j = i + 1; j < nearest[a].count; ++j) {
        const std::uint32_t b = nearest[a].index[static_cast<std::size_t>(i)];
        const std::uint32_t c = nearest[a].index[static_cast<std::size_t>(j)];
        // The lowest of the corners that hold the triangle names it.
        if (b < a && nearest[b].has(a) && nearest[b].has(c)) continue;
        if (c < a && nearest[c].has(a) && nearest[c].has(b)) continue;
        const Triangle triangle = canonical_triangle(corner(a), corner(b), corner(c));
        if (!flat(triangle, observation.points)) triangles.push_back(triangle);
      }
    }
  }
  return triangles;
}

}  // namespace understory::constellation
