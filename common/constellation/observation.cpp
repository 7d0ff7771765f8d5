#include "common/constellation/observation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace understory::constellation {
namespace {

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

void measure_extent(PreparedObservation& prepared) {
  if (prepared.points.empty()) return;
  const auto n = static_cast<double>(prepared.points.size());
  prepared.centre = Eigen::Vector2d::Zero();
  for (const auto& point : prepared.points) prepared.centre += point.position;
  prepared.centre /= n;
  double moment = 0.0;
  for (const auto& point : prepared.points) {
    moment += (point.position - prepared.centre).squaredNorm();
  }
  const double area = std::max(1.0, 2.0 * std::numbers::pi * moment / n);
  prepared.radius_m = std::sqrt(area / std::numbers::pi);
  prepared.density_per_m2 = n / area;
}

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
  }

  measure_extent(prepared);
  return prepared;
}

bool TriangleSource::Neighbours::has(std::uint32_t wanted) const {
  for (int i = 0; i < count; ++i) {
    if (point[static_cast<std::size_t>(i)] == wanted) return true;
  }
  return false;
}

std::vector<std::uint32_t> points_apart(const PreparedObservation& observation, double apart_m) {
  const auto& points = observation.points;
  std::vector<std::uint32_t> by_x(points.size());
  std::iota(by_x.begin(), by_x.end(), 0U);
  std::sort(by_x.begin(), by_x.end(), [&](std::uint32_t a, std::uint32_t b) {
    return points[a].position.x() < points[b].position.x();
  });

  std::vector<char> is_alone(points.size(), 1);
  for (std::size_t i = 0; i < by_x.size(); ++i) {
    const Eigen::Vector2d& own = points[by_x[i]].position;
    for (std::size_t k = i + 1; k < by_x.size(); ++k) {
      const Eigen::Vector2d& other = points[by_x[k]].position;
      if (other.x() - own.x() >= apart_m) break;
      if ((other - own).squaredNorm() >= apart_m * apart_m) continue;
      is_alone[by_x[i]] = is_alone[by_x[k]] = 0;
    }
  }

  std::vector<std::uint32_t> alone;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (is_alone[i] != 0) alone.push_back(i);
  }
  return alone;
}

TriangleSource::TriangleSource(const PreparedObservation& observation,
                               std::span<const std::uint32_t> members, int neighbours)
    : observation_(observation), wanted_(std::clamp(neighbours, 2, kMaxNeighbours)) {
  const std::size_t n = members.size();
  for (const std::uint32_t point : members) {
    const Eigen::Vector2d& position = observation.points[point].position;
    by_x_.push_back({position.x(), position.y(), point});
  }

  std::sort(by_x_.begin(), by_x_.end(), [](const ByX& a, const ByX& b) {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.point < b.point)));
  });

  // Strides of the golden ratio spread the first few points evenly, whatever their order.
  auto stride = static_cast<std::size_t>(0.618 * static_cast<double>(n)) | 1U;
  while (std::gcd(stride, n) != 1) ++stride;
  order_.resize(n);
  for (std::size_t i = 0; i < n; ++i) order_[i] = static_cast<std::uint32_t>((i * stride) % n);
  neighbours_.resize(observation.points.size());
}

/// Points sorted by x: the search for neighbours goes to both sides, until the distance in x alone
/// is too large.
TriangleSource::Neighbours TriangleSource::nearest(std::size_t place) const {
  Neighbours list;
  std::array<double, kMaxNeighbours> squared{};
  const ByX& own = by_x_[place];

  // True while the search may continue.
  const auto consider = [&](const ByX& other) {
    const double dx = other.x - own.x;
    const double dy = other.y - own.y;
    const double d = dx * dx + dy * dy;

    if (list.count == wanted_) {
      const double farthest = squared[static_cast<std::size_t>(wanted_) - 1];
      if (dx * dx > farthest) return false;
      if (d >= farthest) return true;
    }

    auto k = static_cast<std::size_t>(list.count < wanted_ ? list.count++ : wanted_ - 1);
    for (; k > 0 && d < squared[k - 1]; --k) {
      squared[k] = squared[k - 1];
      list.point[k] = list.point[k - 1];
    }

    squared[k] = d;
    list.point[k] = other.point;

    return true;
  };

  // Left and right alternately, so that far points leave the list early.
  std::size_t down = place;
  std::size_t up = place + 1;
  bool go_down = down > 0;
  bool go_up = up < by_x_.size();

  while (go_down || go_up) {
    if (go_down) go_down = consider(by_x_[--down]) && down > 0;
    if (go_up) go_up = consider(by_x_[up++]) && up < by_x_.size();
  }

  return list;
}

std::vector<Triangle> TriangleSource::take(std::size_t count) {
  const auto corner = [&](std::uint32_t point) {
    return Corner{point, point, observation_.points[point].position};
  };

  std::vector<Triangle> triangles;
  triangles.reserve(count * static_cast<std::size_t>(wanted_ * (wanted_ - 1) / 2));
  for (; count > 0 && !exhausted(); --count, ++next_) {
    const std::uint32_t a = by_x_[order_[next_]].point;
    const Neighbours list = nearest(order_[next_]);
    for (int i = 0; i < list.count; ++i) {
      for (int j = i + 1; j < list.count; ++j) {
        const std::uint32_t b = list.point[static_cast<std::size_t>(i)];
        const std::uint32_t c = list.point[static_cast<std::size_t>(j)];
        // Returned before, by another corner?
        if (neighbours_[b].has(a) && neighbours_[b].has(c)) continue;
        if (neighbours_[c].has(a) && neighbours_[c].has(b)) continue;
        const Triangle triangle = canonical_triangle(corner(a), corner(b), corner(c));
        if (!flat(triangle, observation_.points)) triangles.push_back(triangle);
      }
    }

    neighbours_[a] = list;
  }

  return triangles;
}

}  // namespace understory::constellation
