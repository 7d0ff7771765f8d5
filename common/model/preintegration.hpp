// A preintegrated motion at a bias other than that of its integration.
#pragma once

#include "common/model/odometry.hpp"

namespace understory::model {

/// The motion as if `bias` had been subtracted from the samples, to first order in the difference
/// of the biases (Forster et al. 2017). The covariance stays.
Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias);

}  // namespace understory::model
