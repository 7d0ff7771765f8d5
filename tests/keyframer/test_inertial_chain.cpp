#include <Eigen/Dense>
#include <algorithm>
#include <random>

#include "common/model/preintegration.hpp"
#include "services/keyframer/joint/bias_track.hpp"
#include "services/keyframer/joint/block_adjustment.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer::joint;

namespace {

constexpr int kScans = 8;
constexpr double kStep_s = 0.1;
constexpr double kGyro = 1e-4;         // rad, of a step
constexpr double kVelocity = 3e-3;     // m/s, of a step
constexpr double kPosition = 2e-4;     // m, of a step
constexpr double kDetection_m = 0.02;  // per axis

/// Scans at constant forward acceleration in a bend, and the velocity at each in its own axes.
struct Truth {
  std::vector<geometry::SE2> poses;
  std::vector<Eigen::Vector2d> velocities;
  std::vector<Eigen::Vector2d> points;
};

Truth bend(std::mt19937_64& random) {
  std::uniform_real_distribution<double> where(-20.0, 20.0);
  Truth truth;
  for (int k = 0; k < kScans; ++k) {
    const double t = kStep_s * k;
    truth.poses.emplace_back(2.0 * t + 0.4 * t * t, 0.3 * t * t, 0.3 * t);
    const Eigen::Vector2d velocity(2.0 + 0.8 * t, 0.6 * t);
    truth.velocities.emplace_back(truth.poses.back().rotation().transpose() * velocity);
  }
  for (int i = 0; i < 12; ++i) truth.points.emplace_back(where(random), where(random));
  return truth;
}

/// As an IMU with the bias `bias` measures the step from scan k, with noise of `share` of what it
/// states.
model::InertialMotion step(const Truth& truth, std::size_t k, const model::InertialBias& bias,
                           double share, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const geometry::SE2 a_T_b = truth.poses[k].inverse() * truth.poses[k + 1];
  model::InertialMotion motion;
  model::Preintegration& z = motion.inertial;
  z.seconds = kStep_s;
  z.yaw_rad = a_T_b.theta();
  z.velocity_mps = a_T_b.rotation() * truth.velocities[k + 1] - truth.velocities[k];
  z.position_m = a_T_b.translation() - kStep_s * truth.velocities[k];
  z.covariance.diagonal() << kGyro * kGyro, kVelocity * kVelocity, kVelocity * kVelocity,
      kPosition * kPosition, kPosition * kPosition;

  // More of each was measured than there was; subtracting `bias` takes it out again.
  z.bias_jacobian(0, 0) = -kStep_s;
  z.bias_jacobian.block<2, 2>(1, 1) = -kStep_s * Eigen::Matrix2d::Identity();
  z.bias_jacobian.block<2, 2>(3, 1) = -0.5 * kStep_s * kStep_s * Eigen::Matrix2d::Identity();
  const Eigen::Matrix<double, 5, 1> shift = -z.bias_jacobian * bias;
  z.yaw_rad += shift(0) + share * kGyro * normal(random);
  for (int i = 0; i < 2; ++i) {
    z.velocity_mps(i) += shift(1 + i) + share * kVelocity * normal(random);
    z.position_m(i) += shift(3 + i) + share * kPosition * normal(random);
  }
  return motion;
}

BiasEstimate prior() {
  return {model::InertialBias(1e-3, 0.01, -0.02), Eigen::Vector3d(1e-6, 4e-4, 4e-4).asDiagonal()};
}

BlockProblem problem(const Truth& truth, const model::InertialBias& bias, double share,
                     std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  BlockProblem block;
  block.local_T_member = truth.poses;
  block.landmarks = truth.points;
  for (std::uint32_t k = 0; k < truth.poses.size(); ++k) {
    for (std::uint32_t i = 0; i < truth.points.size(); ++i) {
      const Eigen::Vector2d noise(normal(random), normal(random));
      block.observations.push_back(
          {k, i, truth.poses[k].inverse() * truth.points[i] + kDetection_m * noise,
           kDetection_m * kDetection_m * Eigen::Matrix2d::Identity()});
    }
    if (k + 1 < truth.poses.size())
      block.inertial.emplace_back(step(truth, k, bias, share, random));
  }
  block.bias = prior();
  return block;
}

/// The same as one sample of the IMU in each step: three numbers' noise, in a singular covariance.
void make_one_sample(BlockProblem& block, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  for (std::optional<model::InertialMotion>& motion : block.inertial) {
    model::Preintegration& z = motion->inertial;
    Eigen::Matrix<double, 5, 3> input = Eigen::Matrix<double, 5, 3>::Zero();
    input(0, 0) = kGyro;
    input.block<2, 2>(1, 1) = kVelocity * Eigen::Rotation2Dd(0.5 * z.yaw_rad).toRotationMatrix();
    input.block<2, 2>(3, 1) = 0.5 * kStep_s * input.block<2, 2>(1, 1);
    z.covariance = input * input.transpose();

    const Eigen::Matrix<double, 5, 1> error =
        input * Eigen::Vector3d(normal(random), normal(random), normal(random));
    z.yaw_rad += error(0);
    z.velocity_mps += error.segment<2>(1);
    z.position_m += error.tail<2>();
  }
}

/// Squared error of the first pose against the mean of all, which is the gauge, by its covariance;
/// 3 on average.
double shape_nees(const Truth& truth, const BlockEstimate& estimate) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const geometry::SE2 truth_T_centre = truth.poses[0] * estimate.centre_T_member[0].mean.inverse();
  for (std::size_t k = 0; k < truth.poses.size(); ++k) {
    const geometry::SE2 estimated = truth_T_centre * estimate.centre_T_member[k].mean;
    mean += (estimated * truth.poses[k].inverse()).Log() / kScans;
  }
  const Eigen::Matrix3d to_left = truth.poses[0].Adjoint();
  const Eigen::Matrix3d covariance =
      to_left * estimate.centre_T_member[0].covariance * to_left.transpose();
  return mean.dot(covariance.inverse() * mean);
}

model::InertialBias drawn_bias(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sigma = prior().covariance.diagonal().cwiseSqrt();
  return prior().mean +
         sigma.cwiseProduct(Eigen::Vector3d(normal(random), normal(random), normal(random)));
}

}  // namespace

TEST_CASE("Two inertial motions in a row are one", "[inertial]") {
  std::mt19937_64 random(1);
  const Truth truth = bend(random);
  const model::InertialBias none = model::InertialBias::Zero();
  const model::Preintegration first = step(truth, 2, none, 0.0, random).inertial;
  const model::Preintegration second = step(truth, 3, none, 0.0, random).inertial;
  const model::Preintegration both = compound(first, second);

  const geometry::SE2 a_T_b = truth.poses[2].inverse() * truth.poses[4];
  CHECK(both.seconds == Approx(2.0 * kStep_s));
  CHECK(std::abs(both.yaw_rad - a_T_b.theta()) < 1e-12);
  const Eigen::Vector2d velocity = a_T_b.rotation() * truth.velocities[4] - truth.velocities[2];
  CHECK((both.velocity_mps - velocity).norm() < 1e-12);
  const Eigen::Vector2d position = a_T_b.translation() - both.seconds * truth.velocities[2];
  CHECK((both.position_m - position).norm() < 1e-12);

  // Another bias before or after: the same, to first order.
  const model::InertialBias bias(1e-4, 1e-3, -2e-3);
  const model::Preintegration before = compound(at_bias(first, bias), at_bias(second, bias));
  const model::Preintegration after = at_bias(both, bias);
  CHECK(std::abs(before.yaw_rad - after.yaw_rad) < 1e-12);
  CHECK((before.velocity_mps - after.velocity_mps).norm() < 1e-7);
  CHECK((before.position_m - after.position_m).norm() < 1e-8);
}

TEST_CASE("The gradient of an inertial chain is that of its error", "[inertial]") {
  std::mt19937_64 random(2);
  const Truth truth = bend(random);
  const BlockProblem block = problem(truth, drawn_bias(random), 3.0, random);
  InertialChain chain(block.inertial, block.bias);
  std::vector<geometry::SE2> poses = truth.poses;
  std::normal_distribution<double> normal;
  for (geometry::SE2& pose : poses)
    pose =
        pose * geometry::SE2(1e-3 * normal(random), 1e-3 * normal(random), 1e-4 * normal(random));

  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(3 * kScans, 3 * kScans);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(3 * kScans);
  chain.add_to(poses, hessian, gradient);

  // chi2 with the best velocities and bias, numerically; half of it is the cost.
  const auto cost_at = [&](Eigen::Index i, double by) {
    std::vector<geometry::SE2> moved = poses;
    Eigen::Vector3d xi = Eigen::Vector3d::Zero();
    xi(i % 3) = by;
    const auto k = static_cast<std::size_t>(i / 3);
    moved[k] = geometry::SE2::Exp(xi) * moved[k];
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(3 * kScans, 3 * kScans);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * kScans);
    chain.add_to(moved, h, g);
    return 0.5 * chain.chi2();
  };
  for (Eigen::Index i = 0; i < 3 * kScans; ++i) {
    const double numeric = (cost_at(i, 1e-5) - cost_at(i, -1e-5)) / 2e-5;
    CHECK(std::abs(gradient(i) - numeric) < 1e-4 * gradient.cwiseAbs().maxCoeff());
  }

  // No frame is better than another one.
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd common = Eigen::VectorXd::Zero(3 * kScans);
    for (int k = 0; k < kScans; ++k) common(3 * k + axis) = 1.0;
    CHECK((hessian * common).cwiseAbs().maxCoeff() < 1e-3 * hessian.diagonal().maxCoeff());
    CHECK(std::abs(gradient.dot(common)) < 1e-6 * gradient.cwiseAbs().maxCoeff());
  }
}

TEST_CASE("With an IMU a block's shape and the bias are as sure as stated", "[inertial]") {
  std::mt19937_64 random(3);
  const Truth truth = bend(random);
  constexpr int kRuns = 400;
  double nees = 0.0;
  double bias_nees = 0.0;
  double growth = 0.0;
  double with_imu = 0.0;
  double without = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const model::InertialBias bias = drawn_bias(random);
    BlockProblem block = problem(truth, bias, 1.0, random);
    const BlockEstimate estimate = adjust_block(block);
    REQUIRE(estimate.converged);
    REQUIRE(estimate.bias);

    nees += shape_nees(truth, estimate) / (3.0 * kRuns);
    with_imu += estimate.centre_T_member[0].covariance.topLeftCorner<2, 2>().trace() / kRuns;

    const Eigen::Vector3d bias_error = estimate.bias->mean - bias;
    bias_nees += bias_error.dot(estimate.bias->covariance.inverse() * bias_error) / (3.0 * kRuns);
    block.inertial.clear();
    const BlockEstimate by_landmarks = adjust_block(block);
    without += by_landmarks.centre_T_member[0].covariance.topLeftCorner<2, 2>().trace() / kRuns;

    // As many squared errors come with the IMU as numbers do.
    double added = estimate.inertial_chi2;
    for (std::size_t i = 0; i < estimate.chi2.size(); ++i)
      added += estimate.chi2[i] - by_landmarks.chi2[i];
    growth += added / (estimate.inertial_degrees_of_freedom * kRuns);
  }
  CHECK(nees == Approx(1.0).margin(0.12));
  CHECK(bias_nees == Approx(1.0).margin(0.12));
  CHECK(growth == Approx(1.0).margin(0.1));
  CHECK(with_imu < 0.7 * without);
}

TEST_CASE("With one sample in each step a block's shape is as sure as stated", "[inertial]") {
  std::mt19937_64 random(7);
  const Truth truth = bend(random);
  constexpr int kRuns = 400;
  double nees = 0.0;
  double bias_nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const model::InertialBias bias = drawn_bias(random);
    BlockProblem block = problem(truth, bias, 0.0, random);
    make_one_sample(block, random);
    const BlockEstimate estimate = adjust_block(block);
    REQUIRE(estimate.converged);
    REQUIRE(estimate.bias);
    nees += shape_nees(truth, estimate) / (3.0 * kRuns);
    const Eigen::Vector3d bias_error = estimate.bias->mean - bias;
    bias_nees += bias_error.dot(estimate.bias->covariance.inverse() * bias_error) / (3.0 * kRuns);
  }
  CHECK(nees == Approx(1.0).margin(0.15));
  CHECK(bias_nees == Approx(1.0).margin(0.15));
}

TEST_CASE("The bias is learned from block to block, and walks", "[inertial]") {
  std::mt19937_64 random(4);
  const Truth truth = bend(random);
  const model::InertialBias bias = drawn_bias(random);
  geometry::SE2WithCovariance motion;
  motion.covariance = 1e-6 * Eigen::Matrix3d::Identity();

  BiasTrack track;
  const model::InertialMotion any = step(truth, 0, bias, 1.0, random);
  const BiasEstimate start = track.known(any, motion);
  CHECK(start.covariance(1, 1) > 1e-3);
  for (int k = 0; k < 30; ++k) {
    BlockProblem block = problem(truth, bias, 1.0, random);
    block.bias = track.known(any, motion);
    track.learn(*adjust_block(block).bias);
    for (int i = 0; i < kScans; ++i) track.pass(any);
  }
  const BiasEstimate learned = track.known(any, motion);
  CHECK(learned.covariance(1, 1) < 0.15 * start.covariance(1, 1));
  const Eigen::Vector3d error = learned.mean - bias;
  CHECK(error.dot(learned.covariance.inverse() * error) < 16.3);  // 99.9 %

  const double before = learned.covariance(2, 2);
  for (int i = 0; i < 10'000; ++i) track.pass(any);
  CHECK(track.known(any, motion).covariance(2, 2) > before + 9e-4);
  track.forget();
  CHECK(track.known(any, motion).covariance == start.covariance);
}

namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// Standard deviations far above the least ones.
const Eigen::Matrix<double, 5, 1> kSigmas =
    (Eigen::Matrix<double, 5, 1>() << 1e-3, 0.05, 0.05, 2e-3, 2e-3).finished();

/// Correlations and standard deviations about kSigmas of five numbers that `rank` random ones make.
Matrix5 semidefinite(int rank, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root(5, rank);
  for (Eigen::Index i = 0; i < root.size(); ++i) root(i) = normal(random);
  return kSigmas.asDiagonal() * (root * root.transpose()) * kSigmas.asDiagonal();
}

Matrix5 in_sigmas(const Matrix5& matrix) {
  const Eigen::Matrix<double, 5, 1> scale = kSigmas.cwiseInverse();
  return scale.asDiagonal() * matrix * scale.asDiagonal();
}

}  // namespace

TEST_CASE("Each singular covariance of an IMU counts as stated", "[inertial]") {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 10'000; ++trial) {
    const Matrix5 covariance = semidefinite(trial % 6, random);
    const auto information = inertial_information(covariance);
    REQUIRE(information);
    REQUIRE(*information == information->transpose());
    REQUIRE(information->llt().info() == Eigen::Success);

    // The inverse on the range of the covariance, and no more than the least variance beside it.
    const Matrix5 back = covariance * *information * covariance;
    const double size = std::max(1.0, in_sigmas(covariance).norm());
    REQUIRE(in_sigmas(back - covariance).norm() < 1e-3 * size);
    REQUIRE(information->diagonal()
                .cwiseSqrt()
                .cwiseProduct(Eigen::Matrix<double, 5, 1>(1e-6, 1e-4, 1e-4, 1e-5, 1e-5))
                .maxCoeff() < 1.0 + 1e-9);
  }
}

TEST_CASE("A matrix with a negative variance in any direction is no covariance", "[inertial]") {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 10'000; ++trial) {
    Eigen::Matrix<double, 5, 1> direction;
    for (double& x : direction) x = normal(random);
    direction.normalize();

    // The variance along the direction becomes negative, a thousandth of the others'.
    const Matrix5 good = in_sigmas(semidefinite(5, random));
    const double along = direction.dot(good * direction);
    const Matrix5 bad = good - (along + 1e-3 * good.norm()) * direction * direction.transpose();
    REQUIRE_FALSE(inertial_information(kSigmas.asDiagonal() * bad * kSigmas.asDiagonal()));
  }
  CHECK_FALSE(inertial_information(Matrix5::Constant(std::nan(""))));
}
