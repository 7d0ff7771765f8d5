#include "common/model/variogram.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace understory::model {
namespace {

/// Lags pooled by isotonic regression.
struct LagPool {
  double value = 0.0;
  double degrees = 0.0;
  std::size_t count = 0;
};

/// The non-decreasing variogram nearest to the measured one, weighted by degrees of freedom (pool
/// adjacent violators).
std::vector<LagVariance> non_falling(std::span<const LagVariance> lags) {
  std::vector<LagPool> pools;
  for (const LagVariance& one : lags) {
    pools.push_back({one.value, one.degrees, 1});
    while (pools.size() > 1 && pools[pools.size() - 2].value >= pools.back().value) {
      const LagPool last = pools.back();
      pools.pop_back();
      LagPool& pool = pools.back();
      const double degrees = pool.degrees + last.degrees;
      pool = {(pool.value * pool.degrees + last.value * last.degrees) / degrees, degrees,
              pool.count + last.count};
    }
  }

  std::vector<LagVariance> result(lags.begin(), lags.end());
  auto at = result.begin();
  for (const LagPool& pool : pools)
    for (std::size_t i = 0; i < pool.count; ++i, ++at) *at = {at->lag, pool.value, pool.degrees};
  return result;
}

/// The autocovariance at a measured lag; 0 where chance explains it.
double autocovariance(const LagVariance& at, const LagVariance& sill, double sigmas) {
  const double chance = at.value * std::sqrt(2.0 / at.degrees + 2.0 / sill.degrees);
  return std::max(0.0, sill.value - at.value - sigmas * chance);
}

}  // namespace

double white_noise_power(std::span<const LagVariance> lags, std::size_t unit_lag, double sigmas) {
  std::vector<LagVariance> known(lags.begin(), lags.end());
  std::erase_if(known, [](const LagVariance& one) { return one.degrees <= 0.0; });
  const auto unit = std::ranges::find(known, unit_lag, &LagVariance::lag);
  if (unit == known.end()) return 1.0;
  const auto unit_at = unit - known.begin();
  known = non_falling(known);

  // Trapezoids between the measured lags; lag 0 itself is the variance.
  const LagVariance& sill = known.back();
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < known.size(); ++i) {
    const double here = autocovariance(known[i], sill, sigmas);
    const double next = autocovariance(known[i + 1], sill, sigmas);
    const auto steps = static_cast<double>(known[i + 1].lag - known[i].lag);
    sum += 0.5 * (here + next) * steps + 0.5 * (here - next);
  }
  const double unit_value = known[static_cast<std::size_t>(unit_at)].value;
  const double variance =
      unit_value + autocovariance(known[static_cast<std::size_t>(unit_at)], sill, sigmas);
  return (variance + 2.0 * sum) / unit_value;
}

bool outlasts(std::span<const LagVariance> lags, double most) {
  const auto is_known = [](const LagVariance& one) { return one.degrees > 0.0; };
  const auto shortest = std::ranges::find_if(lags, is_known);
  if (shortest == lags.end()) return false;
  const LagVariance& longest = *std::ranges::find_if(lags.rbegin(), lags.rend(), is_known);
  const LagVariance& before = *std::ranges::find_if(shortest, lags.end(), [&](const auto& one) {
    return is_known(one) && 4 * one.lag >= longest.lag;
  });

  const double chance = std::sqrt(2.0 / before.degrees + 2.0 / longest.degrees);
  return longest.value > before.value * (1.0 + most + 2.0 * chance);
}

}  // namespace understory::model
