// Number of elements processed together by vectorised loops.
#pragma once

#include <cstddef>

namespace understory::landmark_extractor {

/// Single-precision numbers that one vector register holds.
inline constexpr std::size_t kLanes = 8;

/// Rounds up to a whole number of registers.
constexpr std::size_t padded_to_lanes(std::size_t count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

}  // namespace understory::landmark_extractor
