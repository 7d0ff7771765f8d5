// Joint evidence of loop closures that agree with each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::geoslam_mapper::smoothing {

/// Evidence of one closure.
struct Witness {
  double from_m = 0.0;  ///< Path length of the vehicle [m] at its two ends.
  double to_m = 0.0;
  double log10_false_alarm = 0.0;  ///< By its sender; 0 if unknown.
};

/// The largest set of witnesses that contains `first` and in which all agree with each other: a
/// maximum clique (Mangelson et al. 2018), found exactly by branch and bound. `agrees[i]`: bit k is
/// set if i and k agree; at most 64 of them. Ascending. Cost: exponential in the number in the
/// worst case, some microseconds if most agree or few do.
std::vector<std::size_t> largest_agreement(std::span<const std::uint64_t> agrees,
                                           std::size_t first);

/// Joint odds of the witnesses in decades. Two whose ends lie within one window of path of each
/// other saw the same landmarks and may share an error: only the better one counts. A witness
/// counts at most 12 decades, since smaller probabilities exceed the accuracy of the model, and 8
/// if it states none.
double decades(std::span<const Witness> witnesses);

/// Decades at which witnesses overrule the graph: two strong ones, or three.
inline constexpr double kBeyondDoubt = 24.0;

}  // namespace understory::geoslam_mapper::smoothing
