// The keyframer's stage, by the method that the configuration names.
#pragma once

#include <memory>

#include "services/keyframer/keyframer_method.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer {

/// The method that `parameters.method` names: "joint" or "baseline". Throws std::invalid_argument
/// on another name.
std::unique_ptr<KeyframerMethod> make_keyframer(const KeyframerParameters& parameters);

}  // namespace understory::keyframer
