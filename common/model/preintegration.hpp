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

}  // namespace understory::model
