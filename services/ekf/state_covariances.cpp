#include "services/ekf/state_covariances.hpp"

#include <cmath>

namespace understory::ekf {

geometry::SE2 vehicle_pose(const FilterState& state) {
  return {state.position + state.anchor_m, state.heading};
}

Eigen::Matrix3d pose_covariance(const FilterState& state) {
  Eigen::Matrix3d to_right = Eigen::Matrix3d::Zero();
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  to_right.block<2, 1>(0, 0) = back * state.lever(state.position);
  to_right.block<2, 2>(0, 1) = back;
  to_right(2, 0) = 1.0;
  return to_right * state.covariance_block<3, 3>(0, 0) * to_right.transpose();
}

Eigen::Matrix3d pose_covariance(const FilterState& state, double pitch_tangent) {
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  Eigen::Matrix<double, 3, 4> pose_by_state = Eigen::Matrix<double, 3, 4>::Zero();
  pose_by_state.block<2, 1>(0, 0) = back * state.lever(state.position);
  pose_by_state.block<2, 2>(0, 1) = back;
  pose_by_state(2, 0) = 1.0;
  pose_by_state(2, 3) = -pitch_tangent;

  Eigen::Matrix4d covariance;
  covariance.topLeftCorner<3, 3>() = state.covariance_block<3, 3>(0, 0);
  covariance.topRightCorner<3, 1>() = state.covariance_block<3, 1>(0, kLevel);
  covariance.bottomLeftCorner<1, 3>() = covariance.topRightCorner<3, 1>().transpose();
  covariance(3, 3) = state.covariance(kLevel, kLevel);
  return pose_by_state * covariance * pose_by_state.transpose();
}

void set_pose_covariance(FilterState& state, const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d from_right = Eigen::Matrix3d::Zero();
  from_right(0, 2) = 1.0;
  from_right.block<2, 2>(1, 0) = rotation_of(state.heading);
  from_right.block<2, 1>(1, 2) = -state.lever(state.position);
  state.covariance().leftCols(3).setZero();
  state.covariance().topLeftCorner<3, 3>() = from_right * covariance * from_right.transpose();
}

Eigen::Matrix<double, 5, 5> velocity_covariance(const FilterState& state) {
  Eigen::Matrix<double, 5, kVehicle> to_vehicle = Eigen::Matrix<double, 5, kVehicle>::Zero();
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  to_vehicle.block<2, 1>(0, kHeading) =
      back * (state.lever(state.velocity) - geometry::perpendicular(state.velocity));
  to_vehicle.block<2, 2>(0, kVelocity) = back;
  to_vehicle.block<3, 3>(2, kBias).setIdentity();
  return to_vehicle * state.covariance_block<kVehicle, kVehicle>(0, 0) * to_vehicle.transpose();
}

Eigen::Matrix2d landmark_covariance(const FilterState& state, std::size_t i) {
  const int row = FilterState::row(i);
  const Eigen::Vector2d arm = state.lever(state.landmarks()[i].position);
  const Eigen::Vector2d shared = state.covariance_block<2, 1>(row, kHeading);
  return state.covariance_block<2, 2>(row, row) + arm * shared.transpose() +
         shared * arm.transpose() + state.covariance(kHeading, kHeading) * arm * arm.transpose();
}

bool is_sound(const FilterState& state) {
  const int n = state.size();
  bool sound = std::isfinite(state.heading) && state.position.allFinite() &&
               state.velocity.allFinite() && state.bias.allFinite() && state.level.allFinite();
  for (int i = 0; i < n; ++i) sound = sound && state.covariance(i, i) >= 0.0;
  for (int i = 0; i < n; ++i) sound = sound && std::isfinite(state.covariance(n - 1, i));
  return sound;
}

void set_prior(FilterState& state, const EkfPriorParameters& prior) {
  state.clear_landmarks();
  auto covariance = state.covariance();
  covariance.setZero();
  covariance.diagonal().segment<2>(kVelocity).setConstant(prior.velocity_sigma_mps *
                                                          prior.velocity_sigma_mps);

  const double gyro = prior.gyro_bias_sigma * prior.gyro_bias_sigma;
  const double force = prior.accelerometer_bias_sigma * prior.accelerometer_bias_sigma;
  covariance.diagonal().segment<3>(kBias) << gyro, force, force;
}

}  // namespace understory::ekf
