#include "common/model/preintegration.hpp"

namespace understory::model {

Preintegration at_bias(const Preintegration& inertial, const InertialBias& bias) {
  Preintegration moved = inertial;
  const Eigen::Matrix<double, 5, 1> shift = inertial.bias_jacobian * (bias - inertial.bias);
  moved.yaw_rad += shift(0);
  moved.velocity_mps += shift.segment<2>(1);
  moved.position_m += shift.tail<2>();
  moved.bias = bias;
  return moved;
}

}  // namespace understory::model
