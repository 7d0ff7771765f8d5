// A preintegrated motion at another bias than that it was integrated with.
#pragma once

#include "common/model/odometry.hpp"

namespace understory::model {

/// To first order in the difference of the biases; the covariance stays.
Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias);

}  // namespace understory::model
