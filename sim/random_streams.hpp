// Independent random streams from one seed, so that a change in one part of a simulation does not
// change the others, and all methods are compared on the same runs.
#pragma once

#include <cstdint>
#include <random>

namespace understory::sim {

/// Purpose of a random stream.
enum class Stream : std::uint64_t {
  kForest = 1,
  kStartPose = 2,
  kObservation = 3,
  kOther = 4,
  kScenery = 5,
  kWheels = 6
};

/// The generator of `stream` number `index` of simulation `seed` (mixed by splitmix64).
inline std::mt19937_64 random_stream(std::uint64_t seed, Stream stream, std::uint64_t index = 0) {
  const auto mix = [](std::uint64_t z) {
    z += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  };
  return std::mt19937_64(mix(mix(mix(seed) ^ static_cast<std::uint64_t>(stream)) ^ index));
}

/// A uniformly distributed number from low to high.
inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

}  // namespace understory::sim
