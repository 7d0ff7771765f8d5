// A forest and what is observed of it, for the tests and the benchmarks of common/hierarchy.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <unordered_map>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/hierarchy/geometric_hierarchy.hpp"

namespace understory::test {

/// Trunks thrown at random, none closer than 3 m to another, at the density of GeoSLAM's
/// intermediate forest (13,770 in 40 m discs of 61), ids 1, 2, ...
inline std::vector<hierarchy::LandmarkPosition> random_forest(std::size_t count,
                                                              std::mt19937_64& random) {
  constexpr double kMinDistance = 3.0;
  const double half_side = 0.5 * std::sqrt(static_cast<double>(count) / 0.0122);
  std::uniform_real_distribution<double> coordinate(-half_side, half_side);
  std::unordered_map<std::int64_t, std::vector<Eigen::Vector2d>> cells;

  const auto cell = [](double x) {
    return static_cast<std::int64_t>(std::floor(x / kMinDistance));
  };

  std::vector<hierarchy::LandmarkPosition> forest;
  while (forest.size() < count) {
    const Eigen::Vector2d p(coordinate(random), coordinate(random));
    bool free = true;
    for (std::int64_t dx = -1; free && dx <= 1; ++dx) {
      for (std::int64_t dy = -1; free && dy <= 1; ++dy) {
        const auto found = cells.find((cell(p.x()) + dx) * 1000003 + cell(p.y()) + dy);
        free = found == cells.end() ||
               std::all_of(found->second.begin(), found->second.end(),
                           [&](const Eigen::Vector2d& q) { return (p - q).norm() > kMinDistance; });
      }
    }

    if (free) {
      cells[cell(p.x()) * 1000003 + cell(p.y())].push_back(p);
      forest.push_back({forest.size() + 1, p});
    }
  }

  return forest;
}

struct View {
  double range_m = 40.0;
  double noise_m = 0.05;   ///< Standard deviation per axis.
  double detection = 0.9;  ///< Probability that a trunk is detected.
  double clutter = 0.0;    ///< False landmarks, as part of the true ones in range.
};

/// What is observed from a pose. A true landmark keeps its id, so that pairs can be judged; false
/// ones have ids from 2^32 on.
inline std::vector<hierarchy::LandmarkPosition> observe(
    const std::vector<hierarchy::LandmarkPosition>& forest, const geometry::SE2& map_T_vehicle,
    const View& view, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, view.noise_m > 0.0 ? view.noise_m : 1.0);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  const geometry::SE2 vehicle_T_map = map_T_vehicle.inverse();
  std::vector<hierarchy::LandmarkPosition> seen;
  std::uint64_t false_id = 1ULL << 32U;

  for (const hierarchy::LandmarkPosition& trunk : forest) {
    if ((trunk.position_m - map_T_vehicle.translation()).norm() > view.range_m) {
      continue;
    }

    if (chance(random) < view.clutter) {
      const double radius = view.range_m * std::sqrt(chance(random));
      const double bearing = 2.0 * std::numbers::pi * chance(random);
      seen.push_back({false_id++, radius * Eigen::Vector2d(std::cos(bearing), std::sin(bearing))});
    }

    if (chance(random) < view.detection) {
      const Eigen::Vector2d error(noise(random), noise(random));
      seen.push_back({trunk.id, vehicle_T_map * trunk.position_m +
                                    (view.noise_m > 0.0 ? error : Eigen::Vector2d::Zero())});
    }
  }

  return seen;
}

}  // namespace understory::test
