// Ranges of VIEW_RANGES as bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace understory::landmark_extractor::view {

/// Largest value of a byte, in units of range.
inline constexpr double kMostSteps = 255.0;

/// Unit with which ranges up to this fit into a byte [m].
constexpr double step_for(double range_m) { return range_m / (kMostSteps - 1.0); }

/// Rounded to a range that is not larger.
inline std::uint8_t rounded_down(double range_m, double step_m) {
  return static_cast<std::uint8_t>(std::min(kMostSteps, std::floor(range_m / step_m)));
}

/// Rounded to a range that is not smaller; 0 if it does not fit into a byte.
inline std::uint8_t rounded_up(double range_m, double step_m) {
  const double steps = std::max(1.0, std::ceil(range_m / step_m));
  return steps > kMostSteps ? 0 : static_cast<std::uint8_t>(steps);
}

}  // namespace understory::landmark_extractor::view
