#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/level_motion.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;

Vector5 vector_of(const model::Preintegration& p) {
  Vector5 v;
  v << p.yaw_rad, p.velocity_mps, p.position_m;
  return v;
}

/// Turning, braking and swerving: planar samples.
std::deque<LevelSample> samples_of(double length_s, model::Utime step_us,
                                   const model::InertialBias& bias, const ImuParameters& noise,
                                   std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::deque<LevelSample> samples;
  for (model::Utime t = 0; test::seconds(t) <= length_s + 1e-9; t += step_us) {
    const double s = test::seconds(t);
    LevelSample sample;
    sample.utime = t;
    sample.yaw_rate_rad_s = 0.6 * std::sin(1.3 * s) + 0.2 + bias(0);
    sample.force_mps2 << 1.5 * std::cos(0.8 * s) + bias(1), 2.0 * std::sin(0.5 * s) - 0.5 + bias(2);
    if (random != nullptr) {
      const double root = 1.0 / std::sqrt(test::seconds(step_us));
      sample.yaw_rate_rad_s += noise.gyro_noise * root * normal(*random);
      for (int axis = 0; axis < 2; ++axis)
        sample.force_mps2(axis) += noise.force_noise * root * normal(*random);
    }
    samples.push_back(sample);
  }
  return samples;
}

ImuParameters plain_noise() {
  ImuParameters imu;
  imu.level_noise = 0.0;
  imu.gyro_scale_sigma = 0.0;
  return imu;
}

}  // namespace

TEST_CASE("preintegration follows a motion known in closed form", "[preintegration]") {
  // Compared to the same motion in steps a hundred times finer.
  const ImuParameters imu = plain_noise();
  const auto fine = preintegrate(samples_of(2.0, 100, model::InertialBias::Zero(), imu, nullptr),
                                 imu, model::InertialBias::Zero());
  const auto coarse =
      preintegrate(samples_of(2.0, 10'000, model::InertialBias::Zero(), imu, nullptr), imu,
                   model::InertialBias::Zero());
  CHECK(coarse.seconds == Approx(2.0));
  CHECK((vector_of(coarse) - vector_of(fine)).norm() < 2e-4);
}

TEST_CASE("intervals of preintegration join to the whole", "[preintegration]") {
  std::mt19937_64 random(1);
  const ImuParameters imu = plain_noise();
  const model::InertialBias bias(0.01, -0.02, 0.03);
  LevelSamples samples(0.1);
  for (const LevelSample& s : samples_of(3.0, 10'000, bias, imu, &random)) samples.add(s);
  std::uniform_int_distribution<model::Utime> cut(100'000, 2'900'000);
  for (int i = 0; i < 50; ++i) {
    const model::Utime at = cut(random);
    const auto whole = preintegrate(*samples.between(0, 3'000'000), imu, bias);
    const auto a = preintegrate(*samples.between(0, at), imu, bias);
    const auto b = preintegrate(*samples.between(at, 3'000'000), imu, bias);
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(a.yaw_rad).toRotationMatrix();
    CHECK(a.yaw_rad + b.yaw_rad == Approx(whole.yaw_rad).margin(1e-9));
    CHECK((a.velocity_mps + turn * b.velocity_mps - whole.velocity_mps).norm() < 1e-4);
    CHECK((a.position_m + a.velocity_mps * b.seconds + turn * b.position_m - whole.position_m)
              .norm() < 1e-4);
  }
}

TEST_CASE("bias Jacobians agree with differences", "[preintegration]") {
  const ImuParameters imu = plain_noise();
  const model::InertialBias bias(0.02, -0.1, 0.05);
  const auto samples = samples_of(1.5, 10'000, bias, imu, nullptr);
  const model::Preintegration at = preintegrate(samples, imu, bias);
  constexpr double h = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const model::InertialBias step = h * model::InertialBias::Unit(axis);
    const Vector5 slope = (vector_of(preintegrate(samples, imu, bias + step)) -
                           vector_of(preintegrate(samples, imu, bias - step))) /
                          (2.0 * h);
    CAPTURE(axis, slope.transpose(), at.bias_jacobian.col(axis).transpose());
    CHECK((at.bias_jacobian.col(axis) - slope).norm() < 1e-3 * (1.0 + slope.norm()));
  }
}

TEST_CASE("the covariance of preintegration is that of its errors", "[preintegration]") {
  std::mt19937_64 random(7);
  ImuParameters imu = plain_noise();
  imu.gyro_noise = 5e-3;
  imu.force_noise = 2e-2;
  const auto clean =
      preintegrate(samples_of(1.0, 10'000, model::InertialBias::Zero(), imu, nullptr), imu,
                   model::InertialBias::Zero());
  Eigen::Matrix<double, 5, 5> spread = Eigen::Matrix<double, 5, 5>::Zero();
  double nees = 0.0;
  constexpr int kRuns = 3000;
  for (int run = 0; run < kRuns; ++run) {
    const auto noisy =
        preintegrate(samples_of(1.0, 10'000, model::InertialBias::Zero(), imu, &random), imu,
                     model::InertialBias::Zero());
    const Vector5 error = vector_of(noisy) - vector_of(clean);
    spread += error * error.transpose() / kRuns;
    nees += error.dot(clean.covariance.ldlt().solve(error)) / kRuns;
  }
  CAPTURE(spread, clean.covariance);
  CHECK(nees > 4.6);
  CHECK(nees < 5.4);
  for (int i = 0; i < 5; ++i) CHECK(clean.covariance(i, i) == Approx(spread(i, i)).epsilon(0.12));
}

TEST_CASE("a gap between samples is not bridged", "[preintegration]") {
  LevelSamples samples(0.1);
  samples.add({.utime = 0});
  samples.add({.utime = 50'000});
  samples.add({.utime = 300'000});
  CHECK(samples.between(0, 50'000));
  CHECK(samples.between(10'000, 40'000)->size() == 2);
  CHECK_FALSE(samples.between(0, 200'000));
  CHECK_FALSE(samples.between(0, 400'000));
  CHECK_FALSE(samples.between(-1, 40'000));
}
