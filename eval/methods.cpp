// make_stages of eval/slam_session.hpp.
#include <stdexcept>

#include "eval/slam_session.hpp"

namespace understory::eval {

const std::vector<std::string>& method_names() {
  static const std::vector<std::string> names{"source", "ours"};
  return names;
}

Stages make_stages(std::string_view method) {
  KeyframerParameters keyframer;
  MapperParameters mapper;
  if (method == "source") {
    keyframer.method = "source";
    mapper.method = "source";
  } else if (method == "ours") {
    keyframer.method = "joint";
    mapper.method = "ours";
  } else {
    throw std::invalid_argument("unknown method '" + std::string(method) + "'");
  }
  return {make_keyframer(keyframer), make_mapper(mapper)};
}

}  // namespace understory::eval
