// The source's local bundle adjustment (GeoSLAM §4.2, algorithm 2), as its published code does it.
#pragma once

#include <memory>

#include "services/keyframer/keyframer.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory {

/// Keyframes of this method are in the frame of their base scan: `centre` is the base, whose
/// covariance is zero, and every landmark has the source's information of 100 I [1/m^2].
std::unique_ptr<KeyframerMethod> make_source_keyframer(const SourceKeyframerParameters& parameters);

}  // namespace understory
