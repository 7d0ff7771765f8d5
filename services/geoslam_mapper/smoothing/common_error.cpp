#include "services/geoslam_mapper/smoothing/common_error.hpp"

#include "common/model/level.hpp"

namespace understory::geoslam_mapper::smoothing {

void CommonError::set_start_level(const Eigen::Matrix2d& covariance) {
  const Eigen::Matrix2d arm = model::level_arm(model::kLandmarkHeight_m);
  start_covariance_m2_ = arm * covariance * arm.transpose();
}

Eigen::Vector2d CommonError::displacement_m(const Eigen::Vector2d& level_rad) {
  return model::level_arm(model::kLandmarkHeight_m) * level_rad;
}

Eigen::Matrix2d CommonError::covariance_of(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d off = scale_sigma_ * position_m;
  return start_covariance_m2_ + off * off.transpose();
}

Eigen::Matrix3d CommonError::covariance_at(const geometry::SE2& map_T_vehicle) const {
  const Eigen::Matrix2d back = map_T_vehicle.rotation().transpose();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() =
      back * covariance_of(map_T_vehicle.translation()) * back.transpose();
  return covariance;
}

}  // namespace understory::geoslam_mapper::smoothing
