// Prediction of the filter's state from one stamp to the next.
#pragma once

#include "common/model/odometry.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/reckoned_track.hpp"

namespace understory::ekf {

/// Standard deviation of an unknown heading.
inline constexpr double kAnyHeading_rad = 1.8;
/// Covariance of (yaw, velocity, position).
using Matrix5 = Eigen::Matrix<double, 5, 5>;
/// Jacobian of the vehicle's state with respect to (yaw, velocity, position).
using VehicleInput = Eigen::Matrix<double, kVehicle, 5>;

/// The vehicle's next state, and how errors propagate: with bias error b and noise n (yaw [rad],
/// velocity [m/s], position [m]) the vehicle's error e becomes `error` e + `noise_input` n; each
/// landmark's error loses lever(landmark) (yaw_by_bias b + n_yaw).
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
  Eigen::Matrix2d level_added =
      Eigen::Matrix2d::Zero();  ///< Covariance of the new part of the level's error [rad^2].
  double seconds = 0.0;
};

/// By integrated IMU samples (preintegration; see model::Preintegration).
Transition transition_by(const FilterState& state, const model::Preintegration& inertial);
/// By measured motion (wheels) over `seconds`: the velocity is that of the motion.
Transition transition_by(const FilterState& state, const geometry::SE2WithCovariance& motion,
                         double seconds, const EkfMotionParameters& parameters);
/// Over `seconds` without odometry: constant velocity, with growing uncertainty of velocity and
/// heading.
Transition transition_over_gap(const FilterState& state, double seconds,
                               const EkfMotionParameters& parameters);

/// Over `seconds` with dead reckoning alone.
Transition transition_over_gap(const FilterState& state, const ReckonedMotion& motion,
                               double seconds, const EkfMotionParameters& parameters);

/// Displacement measured by wheels during a transition by IMU, axes of the vehicle at its start.
struct MeasuredMotion {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
};

/// Adds the first uncertainty of the level's error. It is a part of the accelerometer's bias, which
/// contains the level's error, and, on a slope, of the heading.
void initialise_level(FilterState& state, const model::LevelError& level);

/// Predicts estimate and covariance. O(size^2) for right invariant errors, else O(size).
void predict(FilterState& state, const Transition& transition,
             const EkfMotionParameters& parameters, LowRank& low_rank);
/// Predicts by IMU and updates by the displacement that wheels measured in the same interval,
/// including the noise that both have in common.
void predict(FilterState& state, const model::Preintegration& inertial,
             const MeasuredMotion& measured, const EkfMotionParameters& parameters,
             LowRank& low_rank);

/// Measures that the velocity is zero (stationary vehicle).
void measure_stationary(FilterState& state, double sigma_mps, LowRank& low_rank);
/// Measures that the velocity across the vehicle is zero (no side slip).
void measure_no_slide(FilterState& state, double sigma_mps, LowRank& low_rank);

}  // namespace understory::ekf
