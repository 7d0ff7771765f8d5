// The width in which loops over many numbers are cut.
#pragma once

#include <cstddef>

namespace understory::landmark_extractor {

/// Single-precision numbers that one vector register holds.
inline constexpr std::size_t kLanes = 8;

/// The next whole number of registers.
constexpr std::size_t padded_to_lanes(std::size_t count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

}  // namespace understory::landmark_extractor
