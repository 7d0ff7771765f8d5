// The concept of a shell: a point's visibility by direction and distance of the viewpoint.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstdint>
#include <span>

namespace understory::existence {

/// A shell keeps, as functions of the direction from the point to the sensor,
///   - the visibility w = p(V | E): the odds that the line of sight is free, if the point exists,
///   and
///   - the reach d [m]: the largest distance from which the point has been seen.
/// Compile time only: no virtual call per point. All functions have constant cost.
template <typename S>
concept Shell = requires(S shell, const S& constant, const Eigen::Vector3f& direction, float number,
                         typename S::Place place, std::span<float> numbers) {
  /// Every direction alike: odds of the visibility, reach [m].
  S(number, number);
  /// Place of a direction (length 1) on the shell; computed once per look.
  { constant.locate(direction) } -> std::same_as<typename S::Place>;
  { constant.visibility_odds(place) } -> std::convertible_to<float>;
  { constant.reach_m(place) } -> std::convertible_to<float>;
  /// Multiplies the odds at a place by a likelihood ratio, up to an upper limit.
  shell.multiply(place, number, number);
  /// Raises the reach at a place to at least a distance.
  shell.extend(place, number);
  /// Visibility moves by a share towards a rest probability: w <- w + (rest - w) share.
  shell.relax(number, number);
  /// end_pass(share): mixes the values since begin_pass() with weight `share` and the values before
  /// with the rest.
  shell.begin_pass();
  shell.end_pass(number);
  /// A number from 0 to 23 for the direction: looks with the same number have one viewpoint.
  { constant.sector(place) } -> std::convertible_to<int>;
  /// The complete state for save and load: kNumbers floats.
  { S::kNumbers } -> std::convertible_to<std::size_t>;
  { S::kKind } -> std::convertible_to<std::uint32_t>;
  constant.store(numbers);
  { shell.restore(std::span<const float>(numbers)) } -> std::same_as<bool>;
};

/// Odds of a visibility stay above this: a harmless bound (1e9 misses there move P by 1e-8).
inline constexpr float kLeastVisibilityOdds = 1e-17F;
/// A hit raises lower odds to this first: one blocked line of sight in a hundred has opened by the
/// next look, so that two hits from there are believed. Misses do not use it: otherwise each miss
/// behind a lasting occluder would suggest that the occluder had left.
inline constexpr float kOpenedOdds = 1e-2F;

}  // namespace understory::existence
