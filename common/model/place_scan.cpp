#include "common/model/place_scan.hpp"

#include <cmath>

namespace understory::model {

PlacePoint place_point(const Eigen::Vector3f& position_m) {
  const auto in_cm = [](float value_m) {
    return static_cast<std::int16_t>(std::lround(100.0F * value_m));
  };
  return {in_cm(position_m.x()), in_cm(position_m.y()), in_cm(position_m.z())};
}

}  // namespace understory::model
