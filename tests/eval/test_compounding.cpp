// Compounding (thesis on submaps §2.3.4, §3.4.2) against finite differences and Monte Carlo.
#include "eval/experiments/partition/compounding.hpp"

#include <Eigen/Cholesky>
#include <functional>
#include <random>

#include "common/geometry/se2.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::partition;

namespace {

Eigen::Vector3d random_pose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-40.0, 40.0);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  return {place(random), place(random), angle(random)};
}

/// Central differences.
Eigen::MatrixXd differences(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                            const Eigen::VectorXd& at) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd result(f(at).size(), at.size());
  for (Eigen::Index c = 0; c < at.size(); ++c) {
    Eigen::VectorXd up = at;
    Eigen::VectorXd down = at;
    up(c) += kStep;
    down(c) -= kStep;
    result.col(c) = (f(up) - f(down)) / (2.0 * kStep);
  }
  return result;
}

/// A covariance of full rank whose standard deviations are of a submap: centimetres, milliradians.
Eigen::MatrixXd random_covariance(std::size_t poses, std::size_t points, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto size = static_cast<Eigen::Index>(3 * poses + 2 * points);
  Eigen::MatrixXd mixed = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(size, 0.02);
  for (std::size_t i = 0; i < poses; ++i) sigma(static_cast<Eigen::Index>(3 * i + 2)) = 0.002;
  mixed = sigma.asDiagonal() * mixed / std::sqrt(static_cast<double>(size));
  return mixed * mixed.transpose();
}

/// A relation by the group of rigid motions, which the thesis's equations must agree with.
Eigen::Vector3d by_group(const Eigen::Vector3d& origin, const Eigen::Vector3d& pose) {
  const geometry::SE2 a(origin.x(), origin.y(), origin.z());
  const geometry::SE2 b(pose.x(), pose.y(), pose.z());
  return (a.inverse() * b).coordinates();
}

struct Case {
  Eigen::Vector3d origin;
  std::vector<Eigen::Vector3d> poses;
  std::vector<Eigen::Vector2d> points;
  Eigen::MatrixXd joint;

  Eigen::VectorXd numbers() const {
    Eigen::VectorXd result(joint.rows());
    result.head<3>() = origin;
    Eigen::Index at = 3;
    for (const auto& pose : poses) result.segment<3>(at) = pose, at += 3;
    for (const auto& point : points) result.segment<2>(at) = point, at += 2;
    return result;
  }
  Case at(const Eigen::VectorXd& numbers) const {
    Case result = *this;
    result.origin = numbers.head<3>();
    Eigen::Index row = 3;
    for (auto& pose : result.poses) pose = numbers.segment<3>(row), row += 3;
    for (auto& point : result.points) point = numbers.segment<2>(row), row += 2;
    return result;
  }
  Relations solve(Propagation propagation) const {
    return relations(origin, poses, points, joint, propagation);
  }
};

Case random_case(std::mt19937_64& random) {
  Case one;
  one.origin = random_pose(random);
  one.poses = {random_pose(random), random_pose(random)};
  for (int i = 0; i < 3; ++i) one.points.push_back(random_pose(random).head<2>());
  one.joint = random_covariance(3, 3, random);
  return one;
}

}  // namespace

TEST_CASE("Compounding and its inverse are those of rigid motions", "[partition]") {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d a = random_pose(random);
    const Eigen::Vector3d b = random_pose(random);
    const Eigen::Vector3d got = oplus(ominus(a), b);
    const Eigen::Vector3d expected = by_group(a, b);
    CHECK((got.head<2>() - expected.head<2>()).norm() < 1e-9);
    CHECK(std::abs(geometry::wrap_angle(got.z() - expected.z())) < 1e-9);
    CHECK(oplus(a, ominus(a)).norm() < 1e-9);
  }
}

TEST_CASE("Jacobians of compounding agree with finite differences", "[partition]") {
  std::mt19937_64 random(6);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d a = random_pose(random);
    const Eigen::Vector3d b = random_pose(random);
    const auto first = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return oplus(x, b); };
    const auto second = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return oplus(a, x); };
    const auto inverse = [](const Eigen::VectorXd& x) -> Eigen::VectorXd { return ominus(x); };
    CHECK(oplus_by_first(a, b).isApprox(differences(first, a), 1e-6));
    CHECK(oplus_by_second(a).isApprox(differences(second, b), 1e-6));
    CHECK(ominus_jacobian(a).isApprox(differences(inverse, a), 1e-6));
  }
}

TEST_CASE("The joint covariance of relations agrees with finite differences", "[partition]") {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20; ++i) {
    const Case one = random_case(random);
    const auto f = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return one.at(x).solve(Propagation::kCompounding).mean;
    };
    const Eigen::MatrixXd j = differences(f, one.numbers());
    CHECK(one.solve(Propagation::kCompounding)
              .covariance.isApprox(j * one.joint * j.transpose(), 1e-5));
  }
}

TEST_CASE("The joint covariance of relations agrees with Monte Carlo", "[partition]") {
  constexpr int kSamples = 40'000;
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3; ++i) {
    const Case one = random_case(random);
    const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(one.joint).matrixL();
    const Relations first_order = one.solve(Propagation::kCompounding);
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(first_order.mean.size(), first_order.mean.size());
    for (int k = 0; k < kSamples; ++k) {
      const Eigen::VectorXd noise =
          root * Eigen::VectorXd::NullaryExpr(root.rows(), [&] { return normal(random); });
      const Eigen::VectorXd off =
          one.at(one.numbers() + noise).solve(Propagation::kCompounding).mean - first_order.mean;
      sum += off * off.transpose() / kSamples;
    }

    // The error of a sampled covariance is about sqrt(2 / samples) of it.
    const Eigen::VectorXd sigma = first_order.covariance.diagonal().cwiseSqrt();
    const Eigen::MatrixXd scaled = sigma.cwiseInverse().asDiagonal() *
                                   (sum - first_order.covariance) *
                                   sigma.cwiseInverse().asDiagonal();
    CHECK(scaled.cwiseAbs().maxCoeff() < 0.05);

    // The unscented transform is as good.
    const Eigen::MatrixXd other = sigma.cwiseInverse().asDiagonal() *
                                  (sum - one.solve(Propagation::kUnscented).covariance) *
                                  sigma.cwiseInverse().asDiagonal();
    CHECK(other.cwiseAbs().maxCoeff() < 0.05);
  }
}
