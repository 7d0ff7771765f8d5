#include "services/ekf/vehicle_motion.hpp"

#include "services/ekf/prediction.hpp"
#include "services/ekf/timeline.hpp"

namespace understory::ekf {

void VehicleMotion::predict(const model::Odometry& increment, bool is_stationary,
                            FilterState& state, LowRank& low_rank) {
  if (!increment.inertial) {
    const geometry::SE2WithCovariance moved{increment.from_T_to, increment.covariance};
    const double duration = seconds(increment.utime - increment.from_utime);
    ekf::predict(state, transition_by(state, moved, duration, parameters_), parameters_, low_rank);
  } else if (increment.has_wheels && !is_stationary) {
    take_level(increment.inertial->level, state);
    const Eigen::Matrix2d rotation = increment.from_T_to.rotation();
    const MeasuredMotion measured{
        increment.from_T_to.translation(),
        rotation * increment.covariance.topLeftCorner<2, 2>() * rotation.transpose()};
    ekf::predict(state, *increment.inertial, measured, parameters_, low_rank);
  } else {
    take_level(increment.inertial->level, state);
    ekf::predict(state, transition_by(state, *increment.inertial), parameters_, low_rank);
  }

  if (is_stationary) return;
  if (parameters_.sideways_sigma_mps > 0.0) {
    measure_no_slide(state, parameters_.sideways_sigma_mps, low_rank);
  }
  distance_m_ += increment.from_T_to.translation().norm();
}

void VehicleMotion::bridge(double duration_s, FilterState& state, LowRank& low_rank) {
  distance_m_ += state.velocity.norm() * duration_s;
  loosen(duration_s, state, low_rank);
}

void VehicleMotion::bridge(const ReckonedMotion& motion, double duration_s, FilterState& state,
                           LowRank& low_rank) {
  distance_m_ += motion.from_T_to.mean.translation().norm();
  Transition t = transition_over_gap(state, motion, duration_s, parameters_);
  // The change of the level's error is unknown: it may be a new one.
  if (level_covariance_) t.level_added = *level_covariance_;
  ekf::predict(state, t, parameters_, low_rank);
}

void VehicleMotion::loosen(double duration_s, FilterState& state, LowRank& low_rank) const {
  ekf::predict(state, transition_over_gap(state, duration_s, parameters_), parameters_, low_rank);
}

void VehicleMotion::forget_level() {
  level_covariance_.reset();
  pitch_tangent_ = 0.0;
}

void VehicleMotion::take_level(const model::LevelError& level, FilterState& state) {
  if (!level_covariance_) initialise_level(state, level);
  level_covariance_ = level.covariance;
  pitch_tangent_ = level.pitch_tangent;
}

}  // namespace understory::ekf
