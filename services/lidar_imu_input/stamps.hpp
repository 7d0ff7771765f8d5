// Differences of stamps, squares, and bounds of an unmeasured motion: used by all files of this
// folder.
#pragma once

#include <cmath>

#include "common/model/landmarks.hpp"

namespace understory::lidar_imu_input {

/// Time from one stamp to another [s]; negative if `to` is earlier.
inline double seconds_between(model::Utime from, model::Utime to) {
  return static_cast<double>(to - from) * 1e-6;
}

/// A duration as a difference of stamps [us], rounded.
inline model::Utime microseconds(double seconds) {
  return static_cast<model::Utime>(std::llround(seconds * 1e6));
}

/// The square of a value: a variance from a standard deviation.
inline double square(double value) { return value * value; }

/// Standard deviation of each component of an unknown velocity.
inline constexpr double kStartSpeed_mps = 10.0;
/// Growth of an unmeasured velocity's sigma over a gap [m/s per square root of a second].
inline constexpr double kBridgeSpeed = 2.0;

}  // namespace understory::lidar_imu_input
