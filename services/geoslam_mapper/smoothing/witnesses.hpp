// How much loop closures that agree with each other prove together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::geoslam_mapper::smoothing {

/// What a closure rests on.
struct Witness {
  double from_m = 0.0;  ///< Path of the vehicle [m] where its two ends are.
  double to_m = 0.0;
  double log10_false_alarm = 0.0;  ///< Of its sender; 0 where that does not know.
};

/// The largest set of witnesses that contains `first` and in which all agree with each other: a
/// maximum clique (Mangelson et al. 2018), found exactly by branch and bound. `agrees[i]`: bit k is
/// set where i and k agree; at most 64 of them. Ascending. Cost: exponential in the number in the
/// worst case, some microseconds where most agree or few do.
std::vector<std::size_t> largest_agreement(std::span<const std::uint64_t> agrees,
                                           std::size_t first);

/// Decades of odds that the witnesses have together. Two whose ends lie within one window of path
/// of each other saw the same landmarks and may be wrong alike: of these the better one counts. A
/// witness counts at most 12 decades, since a model that gives less chance than that is not to be
/// believed, and 8 where it states none.
double decades(std::span<const Witness> witnesses);

/// Decades from which on witnesses are believed against the graph: two that are sure, or three.
inline constexpr double kBeyondDoubt = 24.0;

}  // namespace understory::geoslam_mapper::smoothing
