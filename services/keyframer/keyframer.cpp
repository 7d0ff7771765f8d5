#include "services/keyframer/keyframer.hpp"

#include <stdexcept>

#include "services/keyframer/baseline/keyframer.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"

namespace understory::keyframer {

std::unique_ptr<KeyframerMethod> make_keyframer(const KeyframerParameters& parameters) {
  if (parameters.method == "joint") {
    return std::make_unique<joint::JointKeyframer>(parameters.joint);
  }
  if (parameters.method == "baseline") {
    return baseline::make_baseline_keyframer(parameters.baseline);
  }
  throw std::invalid_argument("keyframer: method '" + parameters.method +
                              "' is not one of joint, baseline");
}

}  // namespace understory::keyframer
