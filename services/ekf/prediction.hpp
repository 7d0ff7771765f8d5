// How the filter's state moves from one stamp to the next.
#pragma once

#include "common/model/odometry.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"
#include "services/ekf/parameters.hpp"

namespace understory::ekf {

using Matrix5 = Eigen::Matrix<double, 5, 5>;
using VehicleInput = Eigen::Matrix<double, kVehicle, 5>;

/// The vehicle's next state, and how errors pass on: with bias error b and noise n (yaw, velocity,
/// position) the vehicle's error becomes `error` e + `noise_input` n; each landmark's error loses
/// lever(landmark) (yaw_by_bias b + n_yaw).
struct Transition {
  double heading = 0.0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  model::InertialBias bias = model::InertialBias::Zero();
  Eigen::Vector2d level = Eigen::Vector2d::Zero();
  VehicleMatrix error = VehicleMatrix::Identity();
  VehicleInput noise_input = VehicleInput::Zero();
  Matrix5 noise = Matrix5::Zero();
  Eigen::RowVector3d yaw_by_bias = Eigen::RowVector3d::Zero();
  Eigen::Matrix2d level_added = Eigen::Matrix2d::Zero();  ///< What is new in the level's error.
  double seconds = 0.0;
};

/// By integrated IMU samples.
Transition transition_by(const FilterState& state, const model::Preintegration& inertial);
/// By measured motion (wheels): the velocity is that of the motion.
Transition transition_by(const FilterState& state, const geometry::SE2WithCovariance& motion,
                         double seconds, const EkfMotionParameters& parameters);
/// By nothing: velocity goes on, its uncertainty and the heading's grow.
Transition transition_over_gap(const FilterState& state, double seconds,
                               const EkfMotionParameters& parameters);

/// What else is known of the motion during a transition by IMU: way made, seen from its start [m].
struct MeasuredMotion {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
};

/// The level's error begins as this. It is a part of the accelerometer's bias, which has the
/// level's error in it, and, on a slope, of the heading.
void know_level(FilterState& state, const model::LevelError& level);

/// Predicts the state. `measured` is weighed against the same interval's IMU samples, their common
/// noise respected.
void predict(FilterState& state, const Transition& transition,
             const EkfMotionParameters& parameters, LowRank& room);
void predict(FilterState& state, const model::Preintegration& inertial,
             const MeasuredMotion& measured, const EkfMotionParameters& parameters, LowRank& room);

/// The vehicle stands: velocity zero.
void measure_stationary(FilterState& state, double sigma_mps, LowRank& room);
/// The vehicle does not slide sideways.
void measure_no_slide(FilterState& state, double sigma_mps, LowRank& room);

}  // namespace understory::ekf
