#include "sim/few_landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "sim/hash_random.hpp"
#include "sim/point_grid.hpp"

namespace understory::sim {
namespace {

constexpr double kThinningTileM = 10.0;
/// Halvings of the spacing's bracket: to a hundredth of the range.
constexpr int kHalvings = 12;
/// Number of poses that is sufficient for the mean.
constexpr std::size_t kMostPoses = 400;

std::vector<geometry::SE2> some_of(std::span<const geometry::SE2> poses) {
  const std::size_t step = std::max<std::size_t>(1, poses.size() / kMostPoses);
  std::vector<geometry::SE2> some;
  for (std::size_t i = 0; i < poses.size(); i += step) some.push_back(poses[i]);
  return some;
}

}  // namespace

Forest thinned(const Forest& forest, double spacing_m, std::uint64_t seed) {
  const PointGrid grid(forest.trunks_m, kThinningTileM);
  std::vector<std::uint32_t> order(forest.trunks_m.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [seed](std::uint32_t i) { return mixed(seed, i); });

  std::vector<bool> is_left(order.size(), false);
  for (const std::uint32_t i : order) {
    const auto near = grid.within(forest.trunks_m[i], spacing_m);
    is_left[i] = std::ranges::none_of(near, [&](std::uint32_t k) { return is_left[k]; });
  }

  Forest result{forest.low_m, forest.high_m, {}, {}};
  for (std::size_t i = 0; i < is_left.size(); ++i) {
    if (!is_left[i]) continue;
    result.trunks_m.push_back(forest.trunks_m[i]);
    result.radii_m.push_back(forest.radii_m[i]);
  }
  return result;
}

double mean_in_view(const Forest& forest, std::span<const geometry::SE2> poses,
                    const model::FieldOfView& view) {
  if (poses.empty()) return 0.0;
  const PointGrid grid(forest.trunks_m, kThinningTileM);
  std::size_t in_view = 0;
  for (const geometry::SE2& pose : poses) {
    const geometry::SE2 vehicle_T_world = pose.inverse();
    for (const std::uint32_t i : grid.within(pose.translation(), view.max_range_m))
      in_view += view.contains(vehicle_T_world * forest.trunks_m[i]) ? 1 : 0;
  }
  return static_cast<double>(in_view) / static_cast<double>(poses.size());
}

Forest thinned_to(double wanted, const Forest& forest, std::span<const geometry::SE2> poses,
                  const model::FieldOfView& view, std::uint64_t seed) {
  const std::vector<geometry::SE2> some = some_of(poses);
  Forest best = forest;
  double best_off = mean_in_view(forest, some, view) - wanted;
  if (best_off <= 0.0) return best;

  double low_m = 0.0, high_m = 2.0 * view.max_range_m;
  for (int i = 0; i < kHalvings; ++i) {
    const double spacing_m = 0.5 * (low_m + high_m);
    Forest tried = thinned(forest, spacing_m, seed);
    const double off = mean_in_view(tried, some, view) - wanted;
    (off > 0.0 ? low_m : high_m) = spacing_m;
    if (std::abs(off) >= std::abs(best_off)) continue;
    best_off = off;
    best = std::move(tried);
  }
  return best;
}

}  // namespace understory::sim
