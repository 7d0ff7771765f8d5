// make_stages of eval/harness/slam_session.hpp.
#include <stdexcept>

#include "eval/harness/slam_session.hpp"

namespace understory::eval::harness {

const std::vector<std::string>& method_names() {
  static const std::vector<std::string> names{"baseline", "smoothing"};
  return names;
}

Stages make_stages(std::string_view method, double hand_over_m) {
  keyframer::KeyframerParameters keyframer;
  geoslam_mapper::MapperParameters mapper;
  if (method == "baseline") {
    keyframer.method = "baseline";
    mapper.method = "baseline";
  } else if (method == "smoothing") {
    keyframer.method = "joint";
    mapper.method = "smoothing";
    mapper.smoothing.hand_over_m = hand_over_m;
  } else {
    throw std::invalid_argument("unknown method '" + std::string(method) + "'");
  }
  return {make_keyframer(keyframer), make_mapper(mapper)};
}

}  // namespace understory::eval::harness
