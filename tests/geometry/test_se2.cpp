#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>

#include "common/geometry/alignment.hpp"
#include "common/geometry/decompositions.hpp"
#include "common/geometry/se2.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geometry;

namespace {

Eigen::Vector3d random_tangent(std::mt19937_64& random, double translation, double angle) {
  std::uniform_real_distribution<double> t(-translation, translation);
  std::uniform_real_distribution<double> a(-angle, angle);
  return {t(random), t(random), a(random)};
}

}  // namespace

TEST_CASE("Exp and Log are inverse to each other", "[se2]") {
  std::mt19937_64 random(1);
  for (const double angle : {3.1, 0.5, 1e-4, 1e-6, 1e-9}) {
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d xi = random_tangent(random, 10.0, angle);
      REQUIRE((SE2::Exp(xi).Log() - xi).norm() < 2e-13);
    }
  }
}

TEST_CASE("A half turn is +pi", "[se2]") {
  const double pi = std::numbers::pi;
  for (const double turned : {pi, -pi, 3.0 * pi, -3.0 * pi}) REQUIRE(wrap_angle(turned) == pi);
  REQUIRE(wrap_angle(std::nextafter(-pi, 0.0)) == std::nextafter(-pi, 0.0));
  REQUIRE(wrap_angle(pi + 1.0) == Approx(1.0 - pi));
}

TEST_CASE("Group laws", "[se2]") {
  std::mt19937_64 random(2);
  for (int i = 0; i < 500; ++i) {
    const SE2 a = SE2::Exp(random_tangent(random, 20.0, 3.0));
    const SE2 b = SE2::Exp(random_tangent(random, 20.0, 3.0));
    const SE2 c = SE2::Exp(random_tangent(random, 20.0, 3.0));
    REQUIRE((((a * b) * c).inverse() * (a * (b * c))).Log().norm() < 2e-13);
    REQUIRE((a * a.inverse()).Log().norm() < 2e-13);
    const Eigen::Vector2d p(1.0, -2.0);
    REQUIRE(((a * b) * p - a * (b * p)).norm() < 2e-13);
    const Eigen::Vector3d xi = random_tangent(random, 1.0, 0.5);
    REQUIRE(((a * SE2::Exp(xi) * a.inverse()).inverse() * SE2::Exp(a.Adjoint() * xi)).Log().norm() <
            2e-13);
  }
}

TEST_CASE("The inverse right Jacobian equals the numerical one", "[se2]") {
  std::mt19937_64 random(3);
  for (const double angle : {2.5, 0.3, 1e-3, 1e-5}) {
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d xi = random_tangent(random, 5.0, angle);
      Eigen::Matrix3d numerical;
      const double h = 1e-6;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(k);
        const Eigen::Vector3d plus = (SE2::Exp(xi) * SE2::Exp(d)).Log();
        const Eigen::Vector3d minus = (SE2::Exp(xi) * SE2::Exp(-d)).Log();
        numerical.col(k) = (plus - minus) / (2 * h);
      }
      REQUIRE((numerical - inverse_right_jacobian(xi)).norm() < 5e-9);
    }
  }
}

TEST_CASE("Compounded covariances agree with Monte Carlo", "[se2]") {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const Eigen::Vector3d sigma(0.02, 0.03, 0.01);
  const SE2WithCovariance a{SE2(3, 1, 0.7), sigma.cwiseAbs2().asDiagonal()};
  const SE2WithCovariance b{SE2(-2, 5, -1.2), (0.5 * sigma).cwiseAbs2().asDiagonal()};
  const SE2WithCovariance c = compound(a, inverse(b));
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const int n = 40000;
  for (int i = 0; i < n; ++i) {
    const SE2 sample = a.mean * SE2::Exp(sigma.cwiseProduct(draw())) *
                       (b.mean * SE2::Exp(0.5 * sigma.cwiseProduct(draw()))).inverse();
    const Eigen::Vector3d e = (c.mean.inverse() * sample).Log();
    sum += e * e.transpose();
  }
  // The spread of 40,000 draws.
  REQUIRE((sum / n - c.covariance).norm() < 0.004 * c.covariance.norm());
}

TEST_CASE("Rigid alignment finds the motion, and pairs can be taken away", "[alignment]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-20, 20);
  for (int i = 0; i < 100; ++i) {
    const SE2 truth = SE2::Exp(random_tangent(random, 50.0, 3.1));
    RigidAlignment2 sums;
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector2d b(u(random), u(random));
      sums.add(truth * b, b, 0.5 + k);
    }
    const Eigen::Vector2d wrong(u(random), u(random));
    sums.add(wrong, wrong);
    sums.add(wrong, wrong, -1.0);
    REQUIRE((truth.inverse() * sums.a_T_b()).Log().norm() < 2e-13);
  }
}

TEST_CASE("The inverse of a covariance is symmetric and positive definite at all scales", "[se2]") {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> exponent(-4.0, 3.0);
  for (int i = 0; i < 1000; ++i) {
    // A motion over a long way behind an exact one, or before it.
    SE2WithCovariance first{SE2::Exp(random_tangent(random, 20.0, 3.1))};
    SE2WithCovariance second{SE2::Exp(random_tangent(random, 20.0, 3.1))};
    for (SE2WithCovariance* one : {&first, &second})
      for (int k = 0; k < 3; ++k) one->covariance(k, k) = std::pow(10.0, exponent(random));
    const Eigen::Matrix3d covariance = compound(first, second).covariance;
    const Eigen::Matrix3d information = symmetric_inverse(covariance);

    REQUIRE(information == information.transpose());
    REQUIRE(information.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff() >=
            -1e-15 * information.norm());
    const double bound = 1e-15 * covariance.norm() * information.norm();
    REQUIRE((covariance * information - Eigen::Matrix3d::Identity()).norm() < 1e-12 + 10 * bound);
  }

  // Singular, by rounding not even semi-definite: nothing is infinite.
  Eigen::Matrix3d flat = Eigen::Vector3d(1.0, 1.0, -1e-18).asDiagonal();
  CHECK(symmetric_inverse(flat).allFinite());
}
