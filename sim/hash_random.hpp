// Stateless random numbers that depend on keys alone, so that a ray's result does not depend on
// rays cast earlier.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace understory::sim {

/// The finaliser of splitmix64 (Steele, Lea & Flood 2014).
inline std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}
/// Of two keys, in order.
inline std::uint64_t mixed(std::uint64_t a, std::uint64_t b) { return mixed(mixed(a) ^ b); }

/// In (0, 1), from the upper half of `hash`.
inline double uniform_of(std::uint64_t hash) {
  return (static_cast<double>(hash >> 32) + 0.5) * 0x1p-32;
}
/// Standard normal (Box & Muller 1958), |x| < 6.7.
inline double normal_of(std::uint64_t hash) {
  const double angle = 2.0 * std::numbers::pi * 0x1p-32 * static_cast<double>(hash & 0xffffffffU);
  return std::sqrt(-2.0 * std::log(uniform_of(hash))) * std::cos(angle);
}
/// Exponential with mean 1.
inline double exponential_of(std::uint64_t hash) { return -std::log(uniform_of(hash)); }

}  // namespace understory::sim
