#include "services/geoslam_mapper/smoothing/witnesses.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Longest path [m] over which one closure collects landmarks: the longest window of the loop
/// closer.
constexpr double kWindow_m = 20.0;
constexpr double kMostDecades = 12.0;
constexpr double kUnstatedDecades = 8.0;

double decades_of(const Witness& witness) {
  if (witness.log10_false_alarm == 0.0) return kUnstatedDecades;
  return std::clamp(-witness.log10_false_alarm, 0.0, kMostDecades);
}

bool share_landmarks(const Witness& one, const Witness& other) {
  return std::abs(one.from_m - other.from_m) < kWindow_m ||
         std::abs(one.to_m - other.to_m) < kWindow_m;
}

/// Extends `set` by members of `candidates`; each candidate agrees with the whole set.
void grow(std::span<const std::uint64_t> agrees, std::uint64_t set, std::uint64_t candidates,
          std::uint64_t& best) {
  if (std::popcount(set) > std::popcount(best)) best = set;
  while (candidates != 0 && std::popcount(set) + std::popcount(candidates) > std::popcount(best)) {
    const auto next = static_cast<std::size_t>(std::countr_zero(candidates));
    const std::uint64_t bit = std::uint64_t{1} << next;
    grow(agrees, set | bit, candidates & agrees[next] & ~bit, best);
    candidates &= ~bit;
  }
}

}  // namespace

std::vector<std::size_t> largest_agreement(std::span<const std::uint64_t> agrees,
                                           std::size_t first) {
  const std::uint64_t bit = std::uint64_t{1} << first;
  std::uint64_t best = 0;
  grow(agrees, bit, agrees[first] & ~bit, best);

  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < agrees.size(); ++i)
    if ((best >> i & 1U) != 0) members.push_back(i);
  return members;
}

double decades(std::span<const Witness> witnesses) {
  std::vector<Witness> strongest_first(witnesses.begin(), witnesses.end());
  std::ranges::stable_sort(strongest_first, {},
                           [](const Witness& one) { return -decades_of(one); });

  double sum = 0.0;
  std::vector<Witness> counted;
  for (const Witness& one : strongest_first) {
    if (std::ranges::any_of(counted, [&](const Witness& in) { return share_landmarks(one, in); }))
      continue;
    sum += decades_of(one);
    counted.push_back(one);
  }
  return sum;
}

}  // namespace understory::geoslam_mapper::smoothing
