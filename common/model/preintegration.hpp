// Preintegrated motions at another bias, and their concatenation.
#pragma once

#include "common/model/odometry.hpp"

namespace understory::model {

/// The motion as if `bias` had been subtracted from the samples, to first order in the difference
/// of the biases (Forster et al. 2017). The covariance stays.
Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias);

/// Concatenates two successive motions at the bias of the first; their white noise is independent.
/// The level is that of the second, with the errors added by both.
Preintegration compound(const Preintegration& first, const Preintegration& second);

/// Standard deviation [m/s^2] of an accelerometer's bias without prior knowledge, including the
/// level's error.
inline constexpr double kUnknownAccelerometerBias_mps2 = 0.05;
/// Growth of the variances of the accelerometer's bias (x, y) [m^2/s^4] over a motion, from the
/// random walk as in the filter and from new errors of the level.
Eigen::Vector2d added_accelerometer_bias(const Preintegration& inertial);

}  // namespace understory::model
