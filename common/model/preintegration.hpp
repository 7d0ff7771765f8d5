// Preintegrated motions at another bias, and several in a row.
#pragma once

#include "common/model/odometry.hpp"

namespace understory::model {

/// The motion as if `bias` had been subtracted from the samples, to first order in the difference
/// of the biases (Forster et al. 2017). The covariance stays.
Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias);

/// Two motions in a row as one, at the bias of the first; their white noise is independent. The
/// level is that of the second, with the error that both added.
Preintegration compound(const Preintegration& first, const Preintegration& second);

/// Standard deviation [m/s^2] of an accelerometer's bias before anything is known of it, the
/// level's error included.
inline constexpr double kUnknownAccelerometerBias_mps2 = 0.05;
/// By how much the variances of the accelerometer's bias (x, y) [m^2/s^4] grow over a motion: it
/// walks, as the filter has it, and new errors of the level are part of it.
Eigen::Vector2d added_accelerometer_bias(const Preintegration& inertial);

}  // namespace understory::model
