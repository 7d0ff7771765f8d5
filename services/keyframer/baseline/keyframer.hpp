// The source's local bundle adjustment (GeoSLAM §4.2, algorithm 2), as its published code does it.
#pragma once

#include <memory>

#include "services/keyframer/keyframer.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer::baseline {

/// Keyframes of this method are in the frame of their base scan: `centre` is the base, whose
/// covariance is zero, and every landmark has the source's information of 100 I [1/m^2].
std::unique_ptr<KeyframerMethod> make_baseline_keyframer(
    const BaselineKeyframerParameters& parameters);

}  // namespace understory::keyframer::baseline
