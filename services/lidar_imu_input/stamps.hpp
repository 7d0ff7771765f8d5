// Differences of stamps, and squares: what every file of this room needs.
#pragma once

#include <cmath>

#include "common/model/landmarks.hpp"

namespace understory::lidar_imu_input {

/// Time from one stamp to another [s]; negative where `to` is earlier.
inline double seconds_between(model::Utime from, model::Utime to) {
  return static_cast<double>(to - from) * 1e-6;
}

/// A duration as a difference of stamps [us], rounded.
inline model::Utime microseconds(double seconds) {
  return static_cast<model::Utime>(std::llround(seconds * 1e6));
}

/// The square of a value: a variance from a standard deviation.
inline double square(double value) { return value * value; }

}  // namespace understory::lidar_imu_input
