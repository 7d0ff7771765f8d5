#include "services/loop_closer/self_likeness.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace understory::loop_closer {
namespace {

using place_recognition::LevelStem;

constexpr double kLeastShift_m = 1.0;
constexpr double kMostShift_m = 12.0;
constexpr double kCell_m = 0.5;
constexpr std::size_t kShifts = 12;

/// Differences of positions in one cell.
struct Differences {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double count = 0.0;
};
using Cells = std::map<std::pair<int, int>, Differences>;

/// Half of the plane is sufficient: a shift fits as well as the opposite one.
Cells differences_of(std::span<const LevelStem> stems) {
  Cells cells;
  for (const LevelStem& one : stems) {
    for (const LevelStem& other : stems) {
      const Eigen::Vector2d off = other.position_m - one.position_m;
      const double length_m = off.norm();
      if (off.x() < 0.0 || length_m < kLeastShift_m || length_m > kMostShift_m) continue;
      Differences& cell = cells[{static_cast<int>(std::floor(off.x() / kCell_m)),
                                 static_cast<int>(std::floor(off.y() / kCell_m))}];
      cell.sum_m += off;
      cell.count += 1.0;
    }
  }
  return cells;
}

/// The most frequent differences, each with its neighbouring cells.
std::vector<Eigen::Vector2d> frequent(const Cells& cells) {
  std::vector<std::pair<double, Eigen::Vector2d>> all;
  for (const auto& [at, cell] : cells) {
    Differences around;
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        const auto found = cells.find({at.first + x, at.second + y});
        if (found == cells.end()) continue;
        around.sum_m += found->second.sum_m;
        around.count += found->second.count;
      }
    }
    all.emplace_back(around.count, around.sum_m / around.count);
  }
  std::ranges::stable_sort(all, std::greater(), [](const auto& one) { return one.first; });

  std::vector<Eigen::Vector2d> shifts;
  for (const auto& candidate : all) {
    const Eigen::Vector2d& shift = candidate.second;
    const bool is_new = std::ranges::none_of(
        shifts, [&](const auto& other) { return (other - shift).norm() < 2.0 * kCell_m; });
    if (is_new) shifts.push_back(shift);
    if (shifts.size() == kShifts) break;
  }
  return shifts;
}

}  // namespace

double self_likeness(std::span<const LevelStem> stems, const place_recognition::StemNoise& noise) {
  place_recognition::DiameterStatistics diameters;
  for (const LevelStem& stem : stems) diameters.add(stem.diameter_m);
  const place_recognition::StemLikelihood place(
      place_recognition::view_of({stems.begin(), stems.end()}), noise, diameters.spread());
  double best = 0.0;
  for (const Eigen::Vector2d& shift : frequent(differences_of(stems))) {
    const geometry::SE2 refined = place.refined(stems, geometry::SE2(shift, 0.0));
    if (refined.translation().norm() < 0.5 * kLeastShift_m) continue;
    best = std::max(best, place.log_ratio(stems, refined));
  }
  return best / std::numbers::ln10;
}

}  // namespace understory::loop_closer
