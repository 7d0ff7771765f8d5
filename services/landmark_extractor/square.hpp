// Squares, without the rounding and the cost of a general power.
#pragma once

namespace understory::landmark_extractor {

/// value * value, in the unit's square.
inline double square(double value) { return value * value; }
/// Likewise in single precision.
inline float square(float value) { return value * value; }

}  // namespace understory::landmark_extractor
