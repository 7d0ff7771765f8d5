// The filter's motion against numerical differences and against textbook formulas on full matrices.
#include "services/ekf/prediction.hpp"

#include "services/ekf/state_covariances.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;
using namespace understory::ekf;

namespace {

model::Preintegration random_motion(std::mt19937_64& random) {
  model::Preintegration p;
  p.seconds = 0.4;
  p.yaw_rad = 0.3 * test::normal(random);
  p.velocity_mps = Eigen::Vector2d(test::normal(random), test::normal(random));
  p.position_m = 0.2 * Eigen::Vector2d(test::normal(random), test::normal(random));
  for (int k = 0; k < 15; ++k) p.bias_jacobian.data()[k] = 0.3 * test::normal(random);
  p.bias_jacobian(0, 1) = p.bias_jacobian(0, 2) = 0.0;
  Eigen::Matrix<double, 5, 5> root;
  for (int k = 0; k < 25; ++k) root.data()[k] = 0.05 * test::normal(random);
  p.covariance = root * root.transpose();
  p.bias = 0.05 * Eigen::Vector3d(test::normal(random), test::normal(random), test::normal(random));
  Eigen::Matrix2d small;
  for (int k = 0; k < 4; ++k) small.data()[k] = 0.01 * test::normal(random);
  p.level = {small * small.transpose(), Eigen::Matrix2d::Identity() + 20.0 * small,
             0.5 * small * small.transpose(), 0.1};
  return p;
}

void move(FilterState& state, const Transition& t) {
  state.heading = geometry::wrap_angle(t.heading);
  state.position = t.position;
  state.velocity = t.velocity;
  state.bias = t.bias;
  state.level = t.level;
}

/// The transition of the whole state with its landmarks' rows.
Eigen::MatrixXd whole_error(const FilterState& state, const Transition& t) {
  const int n = state.size();
  Eigen::MatrixXd error = Eigen::MatrixXd::Identity(n, n);
  error.topLeftCorner<kVehicle, kVehicle>() = t.error;
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    error.block<2, 3>(FilterState::row(i), kBias) =
        -state.lever(state.landmarks()[i].position) * t.yaw_by_bias;
  }
  return error;
}

Eigen::MatrixXd whole_input(const FilterState& state, const Transition& t) {
  Eigen::MatrixXd input = Eigen::MatrixXd::Zero(state.size(), 5);
  input.topRows<kVehicle>() = t.noise_input;
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    input.block<2, 1>(FilterState::row(i), 0) = -state.lever(state.landmarks()[i].position);
  }
  return input;
}

/// Of the biases' walk, and of what is new in the level.
Eigen::MatrixXd walk(const FilterState& state, const EkfMotionParameters& p, const Transition& t) {
  const double seconds = t.seconds;
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(state.size(), state.size());
  noise(kBias, kBias) = p.gyro_walk * p.gyro_walk * seconds;
  noise(kBias + 1, kBias + 1) = noise(kBias + 2, kBias + 2) =
      p.accelerometer_walk * p.accelerometer_walk * seconds;
  Eigen::Matrix<double, 4, 2> level;
  level << 9.81 * level_displacement(), Eigen::Matrix2d::Identity();
  noise.block<4, 4>(kBias + 1, kBias + 1) += level * t.level_added * level.transpose();
  return noise;
}

}  // namespace

TEST_CASE("Errors propagate by the numerical Jacobian", "[ekf][prediction]") {
  std::mt19937_64 random(11);
  for (const ErrorForm form : test::kForms) {
    for (int trial = 0; trial < 10; ++trial) {
      const FilterState state = random_state(form, 2, random);
      const model::Preintegration motion = random_motion(random);
      const geometry::SE2WithCovariance wheels{geometry::SE2(0.5, 0.1, 0.2),
                                               Eigen::Matrix3d::Identity()};
      const auto transition = [&](const FilterState& from) {
        return trial % 2 == 0 ? transition_by(from, motion)
                              : transition_by(from, wheels, 0.4, EkfMotionParameters{});
      };
      const Transition t = transition(state);
      FilterState next = state;
      move(next, t);
      const Eigen::MatrixXd error = whole_error(state, t);
      for (int k = 0; k < state.size(); ++k) {
        const double h = 1e-6;
        FilterState plus = state, minus = state;
        plus.retract(h * Eigen::VectorXd::Unit(state.size(), k));
        minus.retract(-h * Eigen::VectorXd::Unit(state.size(), k));
        move(plus, transition(plus));
        move(minus, transition(minus));
        const Eigen::VectorXd column = (difference(next, plus) - difference(next, minus)) / (2 * h);
        CAPTURE(static_cast<int>(form), trial, k);
        REQUIRE((column - error.col(k)).norm() < 3e-8);
      }
    }
  }
}

TEST_CASE("The block-wise prediction is the full one", "[ekf][prediction]") {
  std::mt19937_64 random(12);
  const EkfMotionParameters parameters;
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 7, random);
    LowRank low_rank(state.size());
    const Transition t = transition_by(state, random_motion(random));
    const Eigen::MatrixXd error = whole_error(state, t);
    const Eigen::MatrixXd input = whole_input(state, t);
    const Eigen::MatrixXd expected = error * full_covariance(state) * error.transpose() +
                                     input * t.noise * input.transpose() +
                                     walk(state, parameters, t);
    predict(state, t, parameters, low_rank);
    REQUIRE((full_covariance(state) - expected).norm() < 1e-12 * expected.norm());
  }
}

TEST_CASE("Motion measured over the samples' own interval shares their noise",
          "[ekf][prediction]") {
  std::mt19937_64 random(13);
  EkfMotionParameters parameters;
  parameters.gyro_walk = parameters.accelerometer_walk = 0.0;
  for (const ErrorForm form : test::kForms) {
    for (int run = 0; run < 2; ++run) {
      FilterState state = random_state(form, 3, random);
      const int n = state.size();
      LowRank low_rank(n);
      model::Preintegration motion = random_motion(random);
      motion.bias = state.bias;
      const Transition t = transition_by(state, motion);
      MeasuredMotion measured;
      measured.position_m << 0.3, -0.2;
      measured.covariance_m2 << 0.02, 0.005, 0.005, 0.03;
      // Oracle: state and noise as one vector, measured first, propagated then.
      Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(n + 5, n + 5);
      joint.topLeftCorner(n, n) = full_covariance(state);
      joint.bottomRightCorner(5, 5) = t.noise;
      const auto measure = [&](const FilterState& at) {
        const Eigen::Matrix<double, 5, 1> shift = motion.bias_jacobian * (at.bias - motion.bias);
        return Eigen::Vector2d(rotation_of(at.heading).transpose() * at.velocity * motion.seconds +
                               motion.position_m + shift.tail<2>());
      };
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, n + 5);
      for (int k = 0; k < n; ++k) {
        FilterState plus = state, minus = state;
        plus.retract(1e-6 * Eigen::VectorXd::Unit(n, k));
        minus.retract(-1e-6 * Eigen::VectorXd::Unit(n, k));
        rows.col(k) = (measure(plus) - measure(minus)) / 2e-6;
      }
      rows(0, n + 3) = rows(1, n + 4) = 1.0;
      const Eigen::MatrixXd gain =
          joint * rows.transpose() *
          (rows * joint * rows.transpose() + measured.covariance_m2).inverse();
      Eigen::MatrixXd pass(n, n + 5);
      pass << whole_error(state, t), whole_input(state, t);
      const Eigen::MatrixXd expected =
          pass * (joint - gain * rows * joint) * pass.transpose() + walk(state, parameters, t);
      const Eigen::VectorXd delta = pass * gain * (measured.position_m - measure(state));
      FilterState oracle = state;
      move(oracle, t);
      oracle.retract(delta);
      predict(state, motion, measured, parameters, low_rank);
      REQUIRE((full_covariance(state) - expected).norm() < 1e-9 * expected.norm());
      REQUIRE(difference(oracle, state).norm() < 1e-9 * (1.0 + delta.norm()));
    }
  }
}

TEST_CASE("A stationary measurement observes the velocity alone", "[ekf][prediction]") {
  std::mt19937_64 random(14);
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 3, random);
    state.velocity = 0.01 * Eigen::Vector2d(1.0, -2.0);
    LowRank low_rank(state.size());
    measure_stationary(state, 1e-4, low_rank);
    REQUIRE(state.velocity.norm() < 3.5e-4);
    const Eigen::Matrix2d left = velocity_covariance(state).topLeftCorner<2, 2>();
    // Other forms measure at the old velocity and report at the new one.
    REQUIRE(left.trace() < (form == ErrorForm::kRightInvariant ? 2.1e-8 : 2.5e-4));
    REQUIRE(state.covariance(kPosition, kPosition) > 1e-4);
  }
}

TEST_CASE("Uncertainty grows over a gap", "[ekf][prediction]") {
  std::mt19937_64 random(15);
  const EkfMotionParameters parameters;
  FilterState state = random_state(ErrorForm::kRightInvariant, 2, random);
  state.covariance() = 0.01 * Eigen::MatrixXd::Identity(state.size(), state.size());
  LowRank low_rank(state.size());
  double last = pose_covariance(state).trace();
  for (int k = 0; k < 5; ++k) {
    predict(state, transition_over_gap(state, 1.0, parameters), parameters, low_rank);
    const double now = pose_covariance(state).trace();
    REQUIRE(now > last);
    last = now;
  }
}
