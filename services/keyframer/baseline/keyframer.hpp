// The thesis's local bundle adjustment (GeoSLAM §4.2, algorithm 2), as its published code does it.
#pragma once

#include <memory>

#include "services/keyframer/keyframer_method.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer::baseline {

/// The method `baseline`. Its keyframes are in the frame of their base scan: `centre` is the base,
/// whose covariance is zero, and every landmark has the thesis's information of 100 I [1/m^2].
/// It uses landmarks alone: odometry, filter pose and level are ignored.
std::unique_ptr<KeyframerMethod> make_baseline_keyframer(
    const BaselineKeyframerParameters& parameters);

}  // namespace understory::keyframer::baseline
