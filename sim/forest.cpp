#include "sim/forest.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace understory::sim {
namespace {

constexpr std::array<std::pair<ForestKind, std::string_view>, 3> kForestNames{
    {{ForestKind::kDense, "dense"},
     {ForestKind::kIntermediate, "intermediate"},
     {ForestKind::kSparse, "sparse"}}};

/// Bridson's background grid: each tile holds at most one point.
class Tiles {
 public:
  Tiles(const ForestParameters& parameters, const std::vector<Eigen::Vector2d>& points)
      : points_(points),
        tile_m_(parameters.min_distance_m / std::numbers::sqrt2),
        side_m_(parameters.side_m),
        min_squared_(parameters.min_distance_m * parameters.min_distance_m),
        reach_(parameters.tile_reach),
        count_(static_cast<int>(std::ceil(parameters.side_m / tile_m_))),
        tiles_(static_cast<std::size_t>(count_) * count_, -1) {}

  bool free(const Eigen::Vector2d& p) const {
    if (p.minCoeff() < 0.0 || p.maxCoeff() >= side_m_) return false;
    const int column = static_cast<int>(p.x() / tile_m_);
    const int row = static_cast<int>(p.y() / tile_m_);
    if (tiles_[index(column, row)] >= 0) return false;
    for (int r = std::max(0, row - reach_); r <= std::min(count_ - 1, row + reach_); ++r) {
      for (int c = std::max(0, column - reach_); c <= std::min(count_ - 1, column + reach_); ++c) {
        const std::int32_t other = tiles_[index(c, r)];
        if (other >= 0 && (points_[other] - p).squaredNorm() < min_squared_) return false;
      }
    }
    return true;
  }

  void take(const Eigen::Vector2d& p, std::size_t point) {
    tiles_[index(static_cast<int>(p.x() / tile_m_), static_cast<int>(p.y() / tile_m_))] =
        static_cast<std::int32_t>(point);
  }

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * count_ + column;
  }

  const std::vector<Eigen::Vector2d>& points_;
  double tile_m_;
  double side_m_;
  double min_squared_;
  int reach_;
  int count_;
  std::vector<std::int32_t> tiles_;
};

std::vector<Eigen::Vector2d> poisson_disc(const ForestParameters& parameters,
                                          std::mt19937_64& random) {
  std::uniform_real_distribution<double> anywhere(0.0, parameters.side_m);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * std::numbers::pi);
  std::uniform_real_distribution<double> distance(parameters.min_distance_m,
                                                  2.0 * parameters.min_distance_m);
  std::vector<Eigen::Vector2d> points;
  Tiles tiles(parameters, points);
  std::vector<std::size_t> active;

  const auto add = [&](const Eigen::Vector2d& p) {
    tiles.take(p, points.size());
    active.push_back(points.size());
    points.push_back(p);
  };

  const double first_x = anywhere(random);
  add({first_x, anywhere(random)});
  while (!active.empty()) {
    std::uniform_int_distribution<std::size_t> pick(0, active.size() - 1);
    const std::size_t slot = pick(random);
    bool found = false;

    for (int i = 0; i < parameters.tries && !found; ++i) {
      const double a = angle(random);
      const double d = distance(random);
      const Eigen::Vector2d p =
          points[active[slot]] + d * Eigen::Vector2d(std::cos(a), std::sin(a));
      found = tiles.free(p);
      if (found) add(p);
    }

    if (!found) {
      active[slot] = active.back();
      active.pop_back();
    }
  }

  return points;
}

}  // namespace

ForestParameters forest_parameters(ForestKind kind) {
  ForestParameters parameters;
  switch (kind) {
    case ForestKind::kDense:
      parameters.min_distance_m = 4.0;
      parameters.jitter_sigma_m = 2.0;
      break;
    case ForestKind::kIntermediate:
      break;
    case ForestKind::kSparse:
      parameters.min_distance_m = 9.0;
      parameters.jitter_sigma_m = 3.5;
      break;
  }

  return parameters;
}

std::string_view to_string(ForestKind kind) {
  for (const auto& [value, name] : kForestNames) {
    if (value == kind) return name;
  }
  return "?";
}

std::optional<ForestKind> forest_kind(std::string_view name) {
  for (const auto& [value, known] : kForestNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> forest_names() {
  std::vector<std::string> names;
  names.reserve(kForestNames.size());
  for (const auto& [value, name] : kForestNames) names.emplace_back(name);
  return names;
}

Forest make_forest(const ForestParameters& parameters, std::mt19937_64& random) {
  Forest forest;
  forest.high_m = Eigen::Vector2d::Constant(parameters.side_m);
  forest.trunks_m = poisson_disc(parameters, random);
  std::normal_distribution<double> jitter(0.0, 1.0);
  for (Eigen::Vector2d& trunk : forest.trunks_m) {
    const double dx = jitter(random);
    trunk += parameters.jitter_sigma_m * Eigen::Vector2d(dx, jitter(random));
  }
  forest.radii_m.assign(forest.trunks_m.size(), parameters.trunk_radius_m);
  return forest;
}

}  // namespace understory::sim
