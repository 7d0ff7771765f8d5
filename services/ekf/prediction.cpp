#include "services/ekf/prediction.hpp"

#include <algorithm>
#include <cmath>

#include "common/model/preintegration.hpp"

namespace understory::ekf {
namespace {

/// Displacement and change of velocity in the axes of the map, as functions of the heading at the
/// start; for first-estimate Jacobians from first estimates.
struct Change {
  Eigen::Vector2d position;
  Eigen::Vector2d velocity;
};

Change change(const FilterState& state, const Transition& t, const Eigen::Vector2d& position,
              const Eigen::Vector2d& velocity) {
  if (state.form() != ErrorForm::kFirstEstimate) return {position, velocity};
  return {t.position - state.first_position - state.first_velocity * t.seconds,
          t.velocity - state.first_velocity};
}

/// Sigma of the velocity from two poses of dead reckoning, per axis [m/s].
constexpr double kReckonedVelocity_mps = 0.3;
constexpr double kGravity = 9.81;  // [m/s^2], equal to common/model/imu.hpp

/// Horizontal part of gravity by a level error of (roll, pitch) [m/s^2/rad].
Eigen::Matrix2d gravity_by_level() { return kGravity * level_displacement(); }

/// Propagates the level's error and its contribution to the accelerometer's bias.
void pass_level(const FilterState& state, const model::LevelError& level, Transition& t) {
  const Eigen::Matrix2d change = level.memory - Eigen::Matrix2d::Identity();
  t.level = level.memory * state.level;
  t.bias = state.bias;
  t.bias.tail<2>() += gravity_by_level() * change * state.level;
  t.error.block<2, 2>(kLevel, kLevel) = level.memory;
  t.error.block<2, 2>(kBias + 1, kLevel) = gravity_by_level() * change;
  t.level_added = level.added;
}

/// Fills `error` and `noise_input` for a start of heading `rotation` and preintegrated Jacobians.
void linearise(const FilterState& state, const model::Preintegration& inertial, Transition& t) {
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  const Change changed =
      change(state, t, rotation * inertial.position_m, rotation * inertial.velocity_mps);
  const Eigen::Vector2d p = state.lever(t.position);
  const Eigen::Vector2d v = state.lever(t.velocity);

  t.yaw_by_bias = inertial.bias_jacobian.row(0);
  t.error.block<1, 3>(kHeading, kBias) = t.yaw_by_bias;
  t.error.block<2, 1>(kPosition, kHeading) = state.lever(state.position) +
                                             t.seconds * state.lever(state.velocity) +
                                             geometry::perpendicular(changed.position) - p;
  t.error.block<2, 2>(kPosition, kVelocity) = t.seconds * Eigen::Matrix2d::Identity();
  t.error.block<2, 3>(kPosition, kBias) =
      rotation * inertial.bias_jacobian.bottomRows<2>() - p * t.yaw_by_bias;
  t.error.block<2, 1>(kVelocity, kHeading) =
      state.lever(state.velocity) + geometry::perpendicular(changed.velocity) - v;
  t.error.block<2, 3>(kVelocity, kBias) =
      rotation * inertial.bias_jacobian.middleRows<2>(1) - v * t.yaw_by_bias;

  t.noise_input(kHeading, 0) = 1.0;
  t.noise_input.block<2, 1>(kPosition, 0) = -p;
  t.noise_input.block<2, 2>(kPosition, 3) = rotation;
  t.noise_input.block<2, 1>(kVelocity, 0) = -v;
  t.noise_input.block<2, 2>(kVelocity, 1) = rotation;
  t.noise = inertial.covariance;
}

/// Jacobian of the landmarks' errors with respect to a yaw error: -lever, stacked.
template <typename Arms>
void landmark_arms(const FilterState& state, Arms&& arms) {
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    arms.template segment<2>(2 * static_cast<Eigen::Index>(i)) =
        -state.lever(state.landmarks()[i].position);
  }
}

/// Propagates the block of right invariant landmarks and their covariance with the vehicle for a
/// yaw error. `vehicle`: the vehicle's covariance before the transition.
void rotate_landmarks(FilterState& state, const Transition& t, const VehicleMatrix& vehicle,
                      LowRank& low_rank) {
  const int count = state.size() - kVehicle;
  auto shared = state.covariance().bottomLeftCorner(count, kVehicle);
  auto arms = low_rank.first(count);
  auto mixed = low_rank.second(count);
  landmark_arms(state, arms);
  const double yaw_variance =
      (t.yaw_by_bias * vehicle.block<3, 3>(kBias, kBias)).dot(t.yaw_by_bias) + t.noise(0, 0);
  mixed.noalias() = shared.middleCols<3>(kBias) * t.yaw_by_bias.transpose();
  mixed += 0.5 * yaw_variance * arms;

  auto block = state.covariance().bottomRightCorner(count, count);
  block.selfadjointView<Eigen::Lower>().rankUpdate(arms, mixed);
  shared.noalias() += arms * (t.yaw_by_bias * vehicle.middleRows<3>(kBias));
}

/// Propagates the covariance: O(size^2) if right invariant, else O(size).
void pass_covariance(FilterState& state, const Transition& t, const EkfMotionParameters& parameters,
                     LowRank& low_rank) {
  const int count = state.size() - kVehicle;
  const bool is_invariant = state.form() == ErrorForm::kRightInvariant;
  const VehicleMatrix vehicle = state.covariance_block<kVehicle, kVehicle>(0, 0);
  if (is_invariant) rotate_landmarks(state, t, vehicle, low_rank);

  // Landmarks against the vehicle.
  auto shared = state.covariance().bottomLeftCorner(count, kVehicle);
  const VehicleMatrix passed_on = t.error.transpose();
  for (int i = 0; i < count; ++i) {
    const Eigen::Matrix<double, 1, kVehicle> row = shared.row(i);
    shared.row(i).noalias() = row * passed_on;
  }
  if (is_invariant)
    shared.noalias() += low_rank.first(count) * (t.noise.row(0) * t.noise_input.transpose());

  // The vehicle.
  auto own = state.covariance().topLeftCorner<kVehicle, kVehicle>();
  own = t.error * vehicle * passed_on + t.noise_input * t.noise * t.noise_input.transpose();
  Eigen::Matrix<double, 4, 2> level_input;
  level_input << gravity_by_level(), Eigen::Matrix2d::Identity();
  own.bottomRightCorner<4, 4>() += level_input * t.level_added * level_input.transpose();

  const double gyro = parameters.gyro_walk * parameters.gyro_walk * t.seconds;
  const double force = parameters.accelerometer_walk * parameters.accelerometer_walk * t.seconds;
  own.diagonal().segment<3>(kBias) += Eigen::Vector3d(gyro, force, force);
}

void move_estimate(FilterState& state, const Transition& t) {
  state.heading = geometry::wrap_angle(t.heading);
  state.position = t.position;
  state.velocity = t.velocity;
  state.bias = t.bias;
  state.level = t.level;
  state.first_position = t.position;
  state.first_velocity = t.velocity;
}

}  // namespace

Transition transition_by(const FilterState& state, const model::Preintegration& given) {
  const model::Preintegration inertial = at_bias(given, state.bias);
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  Transition t;
  t.seconds = inertial.seconds;
  t.heading = state.heading + inertial.yaw_rad;
  t.position = state.position + state.velocity * t.seconds + rotation * inertial.position_m;
  t.velocity = state.velocity + rotation * inertial.velocity_mps;
  linearise(state, inertial, t);
  pass_level(state, given.level, t);
  return t;
}

Transition transition_over_gap(const FilterState& state, double seconds,
                               const EkfMotionParameters& parameters) {
  model::Preintegration nothing;
  nothing.seconds = seconds;
  nothing.bias = state.bias;
  const double q = parameters.gap_acceleration * parameters.gap_acceleration;
  const double yaw = std::min(parameters.gap_yaw_rate * seconds, kAnyHeading_rad);
  nothing.covariance(0, 0) = yaw * yaw;
  for (int k = 1; k <= 2; ++k) {
    nothing.covariance(k, k) = q * seconds;
    nothing.covariance(k, k + 2) = nothing.covariance(k + 2, k) = 0.5 * q * seconds * seconds;
    nothing.covariance(k + 2, k + 2) = q * seconds * seconds * seconds / 3.0;
  }
  return transition_by(state, nothing);
}

Transition transition_by(const FilterState& state, const geometry::SE2WithCovariance& motion,
                         double seconds, const EkfMotionParameters& parameters) {
  const geometry::SE2 next = geometry::SE2(state.position, state.heading) * motion.mean;
  const Eigen::Matrix2d rotation = next.rotation();
  Transition t;
  t.seconds = seconds;
  t.heading = next.theta();
  t.position = next.translation();
  t.velocity = rotation * motion.mean.Log().head<2>() / seconds;
  t.bias = state.bias;
  t.level = state.level;

  // Jacobians.
  const Eigen::Vector2d p = state.lever(t.position);
  // The new velocity is fixed to the vehicle: it rotates with the new heading.
  const Eigen::Vector2d v = geometry::perpendicular(t.velocity) - state.lever(t.velocity);
  const Eigen::Vector2d displacement =
      t.position -
      (state.form() == ErrorForm::kFirstEstimate ? state.first_position : state.position);
  t.error.block<2, 1>(kPosition, kHeading) =
      state.lever(state.position) + geometry::perpendicular(displacement) - p;
  t.error.middleRows<2>(kVelocity).setZero();
  t.error.block<2, 1>(kVelocity, kHeading) = v;

  t.noise_input(kHeading, 0) = 1.0;
  t.noise_input.block<2, 1>(kPosition, 0) = -p;
  t.noise_input.block<2, 2>(kPosition, 3) = rotation;
  t.noise_input.block<2, 1>(kVelocity, 0) = v;
  t.noise_input.block<2, 2>(kVelocity, 1) = rotation;

  // Noise: the velocity is the displacement divided by the interval, and may change within it.
  const Eigen::Matrix2d displacement_noise = motion.covariance.topLeftCorner<2, 2>();
  const double change_mps = parameters.wheel_acceleration * seconds;
  t.noise(0, 0) = motion.covariance(2, 2);
  t.noise.block<2, 2>(3, 3) = displacement_noise;
  t.noise.block<2, 2>(1, 3) = displacement_noise / seconds;
  t.noise.block<2, 2>(3, 1) = displacement_noise / seconds;
  t.noise.block<2, 2>(1, 1) = displacement_noise / (seconds * seconds) +
                              change_mps * change_mps * Eigen::Matrix2d::Identity();
  t.noise.block<2, 1>(3, 0) = motion.covariance.block<2, 1>(0, 2);
  t.noise.block<2, 1>(1, 0) = motion.covariance.block<2, 1>(0, 2) / seconds;
  t.noise.row(0).tail<4>() = t.noise.col(0).tail<4>().transpose();
  return t;
}

Transition transition_over_gap(const FilterState& state, const ReckonedMotion& motion,
                               double seconds, const EkfMotionParameters& parameters) {
  Transition t = transition_by(state, motion.from_T_to, seconds, parameters);

  // The velocity at the end, not the mean one.
  t.velocity = rotation_of(t.heading) * motion.velocity_mps;
  const Eigen::Vector2d v = geometry::perpendicular(t.velocity) - state.lever(t.velocity);
  t.error.block<2, 1>(kVelocity, kHeading) = v;
  t.noise_input.block<2, 1>(kVelocity, 0) = v;
  t.noise.middleRows<2>(1).setZero();
  t.noise.middleCols<2>(1).setZero();
  t.noise.block<2, 2>(1, 1) =
      kReckonedVelocity_mps * kReckonedVelocity_mps * Eigen::Matrix2d::Identity();
  return t;
}

void initialise_level(FilterState& state, const model::LevelError& level) {
  Eigen::Matrix<double, kVehicle, 2> by_level = Eigen::Matrix<double, kVehicle, 2>::Zero();
  // The level affects the heading, and right invariant errors, which depend on it.
  by_level(kHeading, 0) = level.pitch_tangent;
  by_level.block<2, 1>(kPosition, 0) = -level.pitch_tangent * state.lever(state.position);
  by_level.block<2, 1>(kVelocity, 0) = -level.pitch_tangent * state.lever(state.velocity);
  by_level.middleRows<2>(kBias + 1) = gravity_by_level();
  by_level.middleRows<2>(kLevel).setIdentity();
  auto own = state.covariance().topLeftCorner<kVehicle, kVehicle>();
  own += (by_level * level.covariance * by_level.transpose())
             .triangularView<Eigen::Lower>()
             .toDenseMatrix();
}

void predict(FilterState& state, const Transition& transition,
             const EkfMotionParameters& parameters, LowRank& low_rank) {
  pass_covariance(state, transition, parameters, low_rank);
  move_estimate(state, transition);
}

void predict(FilterState& state, const model::Preintegration& inertial,
             const MeasuredMotion& measured, const EkfMotionParameters& parameters,
             LowRank& low_rank) {
  const Transition t = transition_by(state, inertial);
  const model::Preintegration own = at_bias(inertial, state.bias);
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();

  // The measurement: the displacement in the axes of the start.
  Eigen::Matrix<double, 2, kVehicle> rows = Eigen::Matrix<double, 2, kVehicle>::Zero();
  rows.col(kHeading) =
      t.seconds * back * (state.lever(state.velocity) - geometry::perpendicular(state.velocity));
  rows.block<2, 2>(0, kVelocity) = t.seconds * back;
  rows.block<2, 3>(0, kBias) = own.bias_jacobian.bottomRows<2>();
  const Eigen::Vector2d innovation =
      measured.position_m - back * state.velocity * t.seconds - own.position_m;

  // Its covariance with the state at the end.
  const int count = state.size() - kVehicle;
  const Eigen::Matrix<double, kVehicle, 2> before =
      state.covariance_block<kVehicle, kVehicle>(0, 0) * rows.transpose();
  const Eigen::Matrix2d spread =
      rows * before + t.noise.bottomRightCorner<2, 2>() + measured.covariance_m2;

  auto cross = low_rank.cross(state.size(), 2);
  const Eigen::Matrix<double, 5, 2> noise = t.noise.rightCols<2>();
  cross.topRows<kVehicle>() = t.error * before + t.noise_input * noise;
  const Eigen::RowVector2d yaw_cross = t.yaw_by_bias * before.middleRows<3>(kBias) + noise.row(0);
  for (int i = 0; i < count; i += 2) {
    const Eigen::Vector2d arm =
        -state.lever(state.landmarks()[static_cast<std::size_t>(i / 2)].position);
    cross.middleRows<2>(kVehicle + i) =
        state.covariance().block<2, kVehicle>(kVehicle + i, 0) * rows.transpose() + arm * yaw_cross;
  }

  predict(state, t, parameters, low_rank);
  low_rank.start(state.size());
  low_rank.apply(state, innovation, spread);
  state.retract(low_rank.delta(state.size()));
}

namespace {

/// Measures the velocity's component along each row of `axes` (unit vectors in the map) as zero.
template <int Rows>
void measure_velocity(FilterState& state, const Eigen::Matrix<double, Rows, 2>& axes,
                      double sigma_mps, LowRank& low_rank) {
  const int n = state.size();
  const Eigen::Vector2d by_heading =
      state.lever(state.velocity) - geometry::perpendicular(state.velocity);
  Eigen::Matrix<double, kVehicle, Rows> rows = Eigen::Matrix<double, kVehicle, Rows>::Zero();
  rows.row(kHeading) = (axes * by_heading).transpose();
  rows.template middleRows<2>(kVelocity) = axes.transpose();

  const Eigen::Matrix<double, kVehicle, Rows> vehicle =
      state.covariance_block<kVehicle, kVehicle>(0, 0) * rows;
  auto cross = low_rank.cross(n, Rows);
  cross.template topRows<kVehicle>() = vehicle;
  if (n > kVehicle) {
    cross.bottomRows(n - kVehicle).noalias() =
        state.covariance().bottomLeftCorner(n - kVehicle, kVehicle) * rows;
  }

  Eigen::Matrix<double, Rows, Rows> spread = rows.transpose() * vehicle;
  spread.diagonal().array() += sigma_mps * sigma_mps;
  const Eigen::Matrix<double, Rows, 1> innovation = -axes * state.velocity;
  low_rank.start(n);
  low_rank.apply(state, innovation, spread);
  state.retract(low_rank.delta(n));
}

}  // namespace

void measure_stationary(FilterState& state, double sigma_mps, LowRank& low_rank) {
  measure_velocity<2>(state, Eigen::Matrix2d::Identity(), sigma_mps, low_rank);
}

void measure_no_slide(FilterState& state, double sigma_mps, LowRank& low_rank) {
  const Eigen::RowVector2d across = rotation_of(state.heading).col(1).transpose();
  measure_velocity<1>(state, across, sigma_mps, low_rank);
}

}  // namespace understory::ekf
