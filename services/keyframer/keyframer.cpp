#include "services/keyframer/keyframer.hpp"

#include <stdexcept>

#include "services/keyframer/joint_keyframer.hpp"
#include "services/keyframer/source_keyframer.hpp"

namespace understory {

std::unique_ptr<KeyframerMethod> make_keyframer(const KeyframerParameters& parameters) {
  if (parameters.method == "joint") return std::make_unique<JointKeyframer>(parameters.joint);
  if (parameters.method == "source") return make_source_keyframer(parameters.source);
  throw std::invalid_argument("keyframer: method '" + parameters.method +
                              "' is not one of joint, source");
}

}  // namespace understory
